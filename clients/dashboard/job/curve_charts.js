// Draws curves over the fit's steps with bands of two standard errors (dygraphs).

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// The legend plugin of dygraphs sets an inline style, which the page's content security policy forbids, so the charts
// draw their own legends.
Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);

// A chart of one or more curves. data: rows [x, [low, mid, high] | null, ...], the custom bars of dygraphs.
export class CurveChart {
  constructor(node, legend, labels, colours, { log = false, digits = 4 } = {}) {
    this.node = node;
    this.legend = legend;
    this.labels = labels;
    this.colours = colours;
    this.options = { log, digits };
    this.hidden = document.createElement("p");
    this.hidden.className = "hint not-shown";
    node.after(this.hidden);
    this.graph = null;
    this.n = 0;
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.restyle = () => this.graph?.updateOptions(this.style());
    this.dark.addEventListener("change", this.restyle);
  }

  style() {
    return { colors: this.colours.map(css), gridLineColor: css("--grid"), axisLineColor: css("--line") };
  }

  formatLegend(values) {
    const digits = this.options.digits;
    return values.map((v, i) => `${this.labels.length > 1 ? `${this.labels[i]} ` : ""}${v === null ? "–" : Number(v.toPrecision(digits))}`).join("   ");
  }

  // The curves are drawn when the node is seen: without a size they cannot be.
  set(rows) {
    this.rows = rows;
    if (this.node.clientWidth > 0) this.draw(rows);
  }

  draw(rows) {
    const usable = rows.filter((r) => r.slice(1).some((v) => v !== null)), left = rows.length - usable.length;
    this.hidden.textContent = left === 0 ? "" : `${left} of ${rows.length} steps are not shown: ${this.options.log ? "no number above 0, which a log axis needs" : "no number"}`;
    if (usable.length === 0) return;
    const last = usable[usable.length - 1].slice(1).map((v) => (v === null ? null : v[1]));
    this.last = last;
    this.legend.textContent = this.formatLegend(last);
    if (this.graph) {
      this.graph.updateOptions({ file: usable });
      return;
    }
    this.graph = new Dygraph(this.node, usable, {
      labels: ["step", ...this.labels],
      customBars: true, logscale: this.options.log, fillAlpha: 0.18, strokeWidth: 1.8, highlightCircleSize: 3.5,
      drawPoints: usable.length < 60, pointSize: 2, xRangePad: 6, yRangePad: 8, legend: "never", labelsUTC: true,
      axes: {
        x: { drawGrid: false, pixelsPerLabel: 50, axisLabelFormatter: (x) => (Number.isInteger(x) ? String(x) : "") },
        y: { axisLabelWidth: 46, pixelsPerLabel: 28, axisLabelFormatter: (y) => (y !== 0 && Math.abs(y) < 1e-3 ? y.toExponential(0) : String(Number(y.toPrecision(3)))) },
      },
      highlightCallback: (_event, x, points) => {
        const by = new Map(points.map((p) => [p.name, p.yval]));
        this.legend.textContent = `step ${x}: ${this.formatLegend(this.labels.map((l) => by.get(l) ?? null))}`;
      },
      unhighlightCallback: () => { this.legend.textContent = this.formatLegend(this.last); },
      ...this.style(),
    });
  }

  // To be called when the node has become visible.
  resize() {
    if (this.node.clientWidth === 0 || !this.rows) return;
    if (!this.graph) this.draw(this.rows);
    else { this.graph.resize(); this.set(this.rows); }
  }

  destroy() {
    this.dark.removeEventListener("change", this.restyle);
    this.graph?.destroy();
  }
}
