// Looks into a dropped table of reflectances: whether its rows say how the cloth was turned, and whether lamp and camera look exchanged.
import { exchangeFault } from "./angle_grid.js";

const HEAD_BYTES = 64 << 10;
const cells = (line, by) => line.split(by).map((cell) => cell.trim().toLowerCase());

// Returns {columns, turned, exchanged}: turned, false when no column says how the cloth was turned and all lamps stand on one side, as of values that do
// not depend on the turn; null for a file that is no CSV table.
export async function tableHead(file) {
  if (!/\.(csv|tsv)$/i.test(file.name)) return null;
  const lines = (await file.slice(0, HEAD_BYTES).text()).split(/\r?\n/).filter((line) => line.trim() !== "" && !line.trim().startsWith("#"));
  const by = ["\t", ";", ","].find((one) => lines[0]?.includes(one)) ?? ",", columns = cells(lines[0] ?? "", by);
  if (!columns.includes("light_theta_deg")) return null;
  const rows = lines.slice(1).map((line) => cells(line, by)).filter((row) => row.length === columns.length);
  const numbers = rows.map((row) => Object.fromEntries(columns.map((name, i) => [name, Number(row[i].replace(",", "."))])));
  const oneSide = new Set(numbers.map((row) => row.light_phi_deg)).size <= 1;
  return { by, turned: columns.includes("cloth_rotation_deg") || !oneSide, exchanged: exchangeFault(numbers), n: rows.length };
}

// The same table with a column that states that its values are means over all turns of the cloth.
export async function withAllRotations(file, by) {
  let isHead = true;
  const lines = (await file.text()).split(/\r?\n/).map((line) => {
    if (line.trim() === "" || line.trim().startsWith("#")) return line;
    const cell = isHead ? "cloth_rotation_deg" : "all";
    isHead = false;
    return line + by + cell;
  });
  return new File([lines.join("\n")], file.name, { type: file.type, lastModified: file.lastModified });
}
