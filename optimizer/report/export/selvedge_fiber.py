"""Made by Selvedge: the fibers of a fitted cloth in Mitsuba 3, with the scattering that was fitted.

    import mitsuba
    mitsuba.set_variant("llvm_ad_rgb")      # or scalar_rgb, which takes minutes where others take seconds
    import selvedge_fiber                   # after the variant was chosen
    picture = mitsuba.render(mitsuba.load_file("exact.xml"))

Two plug-ins are registered. The BSDF `selvedge_fiber` evaluates and samples the models two_lobe.v1 and textile.v3 (parameters in the units of the
job: widths in degrees). The integrator `selvedge_path` is a path tracer that starts light where Selvedge starts it: of textile.v3 at a random place
across the fiber, because that model is a mean over the width; of two_lobe.v1 where the fiber was hit, as the integrator `path` does.

Directions: in the shading frame of a curve y runs along the fiber and z is its normal. th is the angle from the plane across the fiber, ph the azimuth
about it. wi of Mitsuba points to the camera, wo to the light; S is reciprocal or evaluated from the light, as the models state (docs/model.md)."""
import drjit as dr
import mitsuba as mi
import numpy as np

N_TABLE = 512
HALF_PI = float(0.5 * np.pi)
# Smallest and largest value of each parameter; colours have one for each channel.
COLOURS = {f"{name}_{c}": (0, 1) for name in ("C_R", "C_TT") for c in "rgb"}
MODELS = {"two_lobe.v1": {**COLOURS, "beta_R": (1, 10), "beta_TT": (10, 45), "gamma_TT": (1, 45)},
          "textile.v3": {**COLOURS, "beta_R": (1, 30), "beta_TT": (5, 60), "gamma_TT": (5, 60), "w": (0.01, 0.98), "s": (0.02, 0.98), "f": (0.1, 0.98),
                         "h": (0.02, 0.98)}}


def read_parameters(props):
    """Model and parameters by name. ValueError names what is missing or out of range."""
    model = props["model"] if props.has_property("model") else None
    if model not in MODELS:
        raise ValueError(f"selvedge_fiber: 'model' is {model!r}, and must be one of {', '.join(MODELS)}")
    values = {}
    for name, (low, high) in MODELS[model].items():
        if not props.has_property(name):
            raise ValueError(f"selvedge_fiber: the parameter '{name}' of {model} is missing")
        value = props[name]
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
            raise ValueError(f"selvedge_fiber: the parameter '{name}' of {model} is {value!r}, and must be a number from {low} to {high}")
        values[name] = float(value)
    return model, values


def gauss(x, beta):
    return np.exp(-0.5 * (x / beta) ** 2) / (np.sqrt(2 * np.pi) * beta)


class Balance:
    """Scales along the fiber on midpoints of th, by Sinkhorn's balancing (textile.v3), or the published division (two_lobe.v1)."""

    def __init__(self, n=1440):
        self.theta = (np.arange(n) + 0.5) * np.pi / n - HALF_PI
        self.weight = np.cos(self.theta) ** 2 * np.pi / n

    def lobe(self, beta):
        return gauss(self.theta[:, None] + self.theta[None, :], beta) * self.weight[None, :]

    def solve(self, kernel, right):
        scale = np.ones_like(self.theta)
        for _ in range(400):
            scale = np.sqrt(scale * right / (kernel @ scale))
        return scale

    def table(self, values):
        """By |th| at equal steps of [0, pi/2]."""
        return np.interp(np.linspace(0, HALF_PI, N_TABLE + 1), self.theta, values)


def section(f, w, mean_over_turn):
    """v and t of the flat section over ph (textile.v3): t(ph) (f * t)(ph) = 1 - w v(ph)."""
    n = len(mean_over_turn)
    phi = (np.arange(n) + 0.5) * 2 * np.pi / n
    v = np.sqrt(f * f + (1 - f * f) * np.cos(phi) ** 2)
    kernel, right, t = np.fft.rfft(mean_over_turn) / n, 1 - w * v, np.sqrt(1 - w * v)
    for _ in range(200):
        t = np.sqrt(t * right / np.fft.irfft(np.fft.rfft(t) * kernel, n))
    return phi, v, t


class Curve:
    """A function of x in [0, 1] by straight lines between equal steps, in every variant of Mitsuba."""

    def __init__(self, values):
        self.texture = mi.Texture1f(mi.TensorXf(np.ascontiguousarray(values, dtype=np.float32).reshape(-1, 1)), use_accel=False,
                                    filter_mode=dr.FilterMode.Linear, wrap_mode=dr.WrapMode.Clamp)
        self.n = len(values)

    def __call__(self, x, active=True):
        place = (dr.clip(x, 0, 1) * (self.n - 1) + 0.5) / self.n  # samples stand in the middle of texels
        return self.texture.eval(mi.Point1f(place), active)[0]


class Fiber(mi.BSDF):
    """S cos th_i of two_lobe.v1 or textile.v3."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.m_components = [mi.BSDFFlags.Glossy | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide | mi.BSDFFlags.Anisotropic]
        self.m_flags = self.m_components[0]
        model, value = read_parameters(props)
        self.textile = model == "textile.v3"
        self.c_r, self.c_tt = ([value[f"{name}_{c}"] for c in "rgb"] for name in ("C_R", "C_TT"))
        self.beta = [float(np.radians(value[name])) for name in ("beta_R", "beta_TT")]
        self.gamma = float(np.radians(value["gamma_TT"]))
        self.w, self.s, self.f, self.h = ((value[name] for name in "wsfh") if self.textile else (0.0, 0.0, 1.0, 0.5))
        self.prepare()
        self.choose()

    def prepare(self):
        n = 4096
        phi = (np.arange(n) + 0.5) * 2 * np.pi / n - np.pi
        von_mises = np.exp((np.cos(phi) - 1) / self.gamma ** 2)
        self.peak = float(1 / (von_mises.sum() * 2 * np.pi / n))  # the density straight on
        balance = Balance()
        if not self.textile:
            self.scale = [Curve(balance.table(1 / balance.lobe(b).sum(1))) for b in self.beta]
            return
        around = (1 - self.s) / (2 * np.pi) + self.s * np.abs(np.cos(phi / 2)) / 4
        moments = [(around * np.cos(phi / 2) ** j).sum() * 2 * np.pi / n for j in range(6)]
        binomial = [1, -5, 10, -10, 5, -1]  # of (1 - x)^5
        self.rise = [float(b * m) for b, m in zip(binomial, moments)]  # K in powers of cos d
        cos_d = np.cos(0.5 * (balance.theta[:, None] - balance.theta[None, :]))
        share = sum(c * cos_d ** j for j, c in enumerate(self.rise))
        lobe = [balance.lobe(b) for b in self.beta]
        a = balance.solve(lobe[0], np.ones_like(balance.theta))
        rho = a * ((lobe[0] * share) @ a)
        b = balance.solve(lobe[1] * (1 - share), 1 - rho)
        q = 1 - rho
        self.inv_z = float(1 / (2 * np.pi * (q * balance.weight).sum()))
        self.scale = [Curve(balance.table(a)), Curve(balance.table(b))]
        self.inside = Curve(balance.table(q))
        kernel = np.exp((np.cos((np.arange(1024)) * 2 * np.pi / 1024) - 1) / self.gamma ** 2)
        turn, v, t = section(self.f, self.w, kernel / kernel.mean())
        self.inv_mean_v = float(1 / v.mean())
        order = np.argsort(np.abs(np.cos(turn)))
        self.through = Curve(np.interp(np.linspace(0, 1, 257), np.abs(np.cos(turn))[order], t[order]))

    def choose(self):
        """Shares of the samples: R, TT and the light that is scattered inside."""
        r, tt = np.mean(self.c_r) + 0.05, np.mean([t * (1 - r) for r, t in zip(self.c_r, self.c_tt)])
        parts = np.array([r, tt * (1 - self.w), tt * self.w if self.textile else 0.0])
        parts = np.maximum(parts / parts.sum(), [0.05, 0.05, 0.05 if self.textile else 0.0])
        self.part = [float(x) for x in parts / parts.sum()]
        # logistic densities draw th_i and ph; their tails are wider than the tails of the lobes
        self.along = [0.62 * b for b in self.beta]
        self.about = 0.62 * self.gamma

    # ---- directions ----

    @staticmethod
    def angles(w):
        sin = dr.clip(w.y, -1, 1)
        cos = dr.sqrt(dr.maximum(1 - sin * sin, 1e-12))
        return dr.asin(sin), sin, cos

    @staticmethod
    def flat_normal(si):
        """The normal of the flat section in the plane across the fiber: as near to the cloth's normal z as the fiber's direction lets it."""
        up = si.to_local(mi.Vector3f(0, 0, 1))
        length = dr.sqrt(up.x * up.x + up.z * up.z)
        return dr.select(length > 1e-6, up.z / length, 1), dr.select(length > 1e-6, up.x / length, 0)

    def width_of(self, cos_psi):
        return dr.sqrt(self.f ** 2 + (1 - self.f ** 2) * cos_psi * cos_psi)

    def values(self, si, wo):
        """S cos th_i by channel."""
        theta_i, _, cos_i = self.angles(wo)
        theta_o, _, cos_o = self.angles(si.wi)
        cos_phi = dr.clip((wo.x * si.wi.x + wo.z * si.wi.z) / (cos_i * cos_o), -1, 1)
        x_i, x_o = dr.abs(theta_i) / HALF_PI, dr.abs(theta_o) / HALF_PI
        total = theta_i + theta_o
        lobe = [dr.exp(-0.5 * (total / b) ** 2) / (float(np.sqrt(2 * np.pi)) * b) for b in self.beta]
        von_mises = self.peak * dr.exp((-cos_phi - 1) / self.gamma ** 2)
        if not self.textile:
            r = lobe[0] * self.scale[0](x_i) / (2 * np.pi)
            tt = lobe[1] * self.scale[1](x_i) * von_mises
            k = (1 - cos_i) ** 5
            rgb = [(c + (1 - c) * k) * r + t * (1 - c) * (1 - k) * tt for c, t in zip(self.c_r, self.c_tt)]
            return mi.Color3f(*rgb) * cos_i
        cos_d, half = dr.cos(0.5 * (theta_i - theta_o)), dr.sqrt(0.5 * (1 + cos_phi))
        k = (1 - cos_d * half) ** 5
        share = sum(c * cos_d ** j for j, c in enumerate(self.rise))
        r = lobe[0] * self.scale[0](x_i) * self.scale[0](x_o) * ((1 - self.s) / (2 * np.pi) + self.s * half / 4)
        n_z, n_x = self.flat_normal(si)
        psi_i, psi_o = dr.abs(wo.z * n_z + wo.x * n_x) / cos_i, dr.abs(si.wi.z * n_z + si.wi.x * n_x) / cos_o
        tt = lobe[1] * self.scale[1](x_i) * self.scale[1](x_o) * (1 - share) * von_mises * self.through(psi_i) * self.through(psi_o)
        d = self.inside(x_i) * self.inside(x_o) * self.inv_z * self.width_of(psi_i) * self.width_of(psi_o) * self.inv_mean_v
        inside = tt + self.w * d * (1 - (2 * self.h - 1) * cos_phi)
        return mi.Color3f(*[r * (c + (1 - c) * k) + t * (1 - c) * inside for c, t in zip(self.c_r, self.c_tt)]) * cos_i

    @staticmethod
    def logistic_cdf(x, s):
        return 1 / (1 + dr.exp(-x / s))

    def density(self, si, wo):
        theta_i, _, cos_i = self.angles(wo)
        theta_o, _, cos_o = self.angles(si.wi)
        cos_phi = dr.clip((wo.x * si.wi.x + wo.z * si.wi.z) / (cos_i * cos_o), -1, 1)
        pdf = 0.0
        for k in range(2):
            s = self.along[k]
            e = dr.exp(-dr.abs(theta_i + theta_o) / s)
            inside = self.logistic_cdf(HALF_PI + theta_o, s) - self.logistic_cdf(-HALF_PI + theta_o, s)
            along = e / (s * (1 + e) ** 2 * inside) / cos_i
            if k == 0:
                pdf += self.part[0] * along / (2 * np.pi)
                continue
            t = self.about
            e = dr.exp(-dr.acos(dr.clip(-cos_phi, -1, 1)) / t)
            pdf += self.part[1] * along * e / (t * (1 + e) ** 2 * float(np.tanh(np.pi / (2 * t))))
        return pdf + self.part[2] * cos_i / np.pi ** 2

    # ---- the interface of a BSDF ----

    def sample(self, ctx, si, sample1, sample2, active=True):
        theta_o, _, cos_o = self.angles(si.wi)
        pick_r, pick_tt = sample1 < self.part[0], sample1 < self.part[0] + self.part[1]
        # the unused part of sample1 is uniform again
        rest = dr.select(pick_r, sample1 / self.part[0], dr.select(pick_tt, (sample1 - self.part[0]) / self.part[1],
                                                                   (sample1 - self.part[0] - self.part[1]) / max(self.part[2], 1e-9)))
        rest = dr.clip(rest, 1e-6, 1 - 1e-6)
        s = dr.select(pick_r, self.along[0], self.along[1])
        low, high = self.logistic_cdf(-HALF_PI + theta_o, s), self.logistic_cdf(HALF_PI + theta_o, s)
        u = dr.clip(low + sample2.x * (high - low), 1e-7, 1 - 1e-7)
        theta = dr.clip(-theta_o - s * dr.log(1 / u - 1), -HALF_PI, HALF_PI)
        below = float(1 / (1 + np.exp(np.pi / self.about)))
        v = dr.clip(below + sample2.y * (1 - 2 * below), 1e-7, 1 - 1e-7)
        phi = dr.select(pick_r, 2 * np.pi * sample2.y, np.pi - self.about * dr.log(1 / v - 1))
        # cos^2 th d th: the sine is one coordinate of a point in the unit disk
        sin = dr.select(pick_tt, dr.sin(theta), dr.sqrt(rest) * dr.cos(2 * np.pi * sample2.x))
        phi = dr.select(pick_tt, phi, 2 * np.pi * sample2.y)
        cos = dr.sqrt(dr.maximum(1 - sin * sin, 0))
        across = dr.sqrt(si.wi.x * si.wi.x + si.wi.z * si.wi.z)
        a_z, a_x = dr.select(across > 1e-9, si.wi.z / across, 1), dr.select(across > 1e-9, si.wi.x / across, 0)
        cos_phi, sin_phi = dr.cos(phi), dr.sin(phi)
        wo = mi.Vector3f(cos * (a_x * cos_phi + a_z * sin_phi), sin, cos * (a_z * cos_phi - a_x * sin_phi))
        bs = mi.BSDFSample3f()
        bs.wo, bs.pdf, bs.eta = wo, self.density(si, wo), 1.0
        bs.sampled_type, bs.sampled_component = +self.m_flags, 0
        active &= (bs.pdf > 0) & dr.isfinite(bs.pdf)
        return bs, dr.select(active, self.values(si, wo) / bs.pdf, 0)

    def eval(self, ctx, si, wo, active=True):
        return dr.select(active, self.values(si, wo), 0)

    def pdf(self, ctx, si, wo, active=True):
        return dr.select(active, self.density(si, wo), 0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return f"Selvedge fiber, {'textile.v3' if self.textile else 'two_lobe.v1'}"


def across(si, direction, place):
    """Where light leaves a fiber that is seen from `direction`, at a place of its width in [0, 1). The length of dp_du, around the curve, is its
    circumference."""
    radius = dr.norm(si.dp_du) / (2 * np.pi)
    along, axis = dr.normalize(si.dp_dv), si.p - radius * si.n
    to = direction - along * dr.dot(along, direction)
    length = dr.norm(to)
    to = dr.select(length > 1e-6, to / length, si.n)
    offset = 2 * place - 1
    return axis + radius * (1 + 1e-4) * (offset * dr.cross(along, to) + dr.sqrt(1 - offset * offset) * to)


class Path(mi.SamplingIntegrator):
    """Paths with light that is sampled at every hit, both weighted by the balance of powers."""

    def __init__(self, props):
        mi.SamplingIntegrator.__init__(self, props)
        self.max_depth = props.get("max_depth", 1000)
        self.rr_depth = props.get("rr_depth", 20)
        self.whole_width = props.get("whole_width", True)

    @staticmethod
    def weight(a, b):
        return dr.select(a > 0, a * a / (a * a + b * b), 0)

    def sample(self, scene, sampler, ray, medium=None, active=True):
        def bounce(sampler, ray, throughput, result, depth, pdf, before, hit, active):
            si = scene.ray_intersect(ray, mi.RayFlags.All, depth == 0, active)
            hit |= active & si.is_valid()
            ds = mi.DirectionSample3f(scene, si, before)
            lit = active & (ds.emitter != None)  # noqa: E711  pylint: disable=singleton-comparison
            if not isinstance(lit, bool) or lit:
                em_pdf = scene.pdf_emitter_direction(before, ds, lit & (depth > 0))
                share = dr.select(depth == 0, 1, self.weight(pdf, em_pdf))
                result = result + dr.select(lit, throughput * share * ds.emitter.eval(si, lit), 0)
            active &= si.is_valid() & (depth < self.max_depth)
            if isinstance(active, bool) and not active:  # scalar variants have no shape here
                return sampler, ray, throughput, result, depth, pdf, before, hit, active
            bsdf = si.bsdf(ray)
            moved = active & (si.shape.shape_type() == +mi.ShapeType.BSplineCurve) & self.whole_width
            # light from the lamps
            ds, em = scene.sample_emitter_direction(si, sampler.next_2d(active), False, active)
            use, place, ahead = active & (ds.pdf > 0), sampler.next_1d(active), si.spawn_ray_to(ds.p)
            origin = dr.select(moved, across(si, ds.d, place), ahead.o)
            shadow = mi.Ray3f(origin, ahead.d, ahead.maxt, ray.time, ray.wavelengths)
            use = dr.select(scene.ray_test(shadow, use), False, use)
            value, b_pdf = bsdf.eval_pdf(ctx, si, si.to_local(ds.d), use)
            share = dr.select(ds.delta, 1, self.weight(ds.pdf, b_pdf))
            result = result + dr.select(use, throughput * value * em * share, 0)
            # and onwards
            bs, factor = bsdf.sample(ctx, si, sampler.next_1d(active), sampler.next_2d(active), active)
            direction, place = si.to_world(bs.wo), sampler.next_1d(active)
            ahead = si.spawn_ray(direction)
            ray = mi.Ray3f(dr.select(moved, across(si, direction, place), ahead.o), direction, ahead.maxt, ray.time, ray.wavelengths)
            throughput = dr.select(active, throughput * factor, throughput)
            depth = depth + 1
            most = dr.max(throughput)
            keep = dr.select(depth < self.rr_depth, 1, dr.minimum(most, 0.95))
            active &= (most > 0) & (sampler.next_1d(active) < keep)
            throughput = throughput * dr.select(keep > 0, 1 / dr.maximum(keep, 1e-9), 0)
            return sampler, ray, throughput, result, depth, bs.pdf, mi.Interaction3f(si), hit, active

        ctx = mi.BSDFContext()
        state = (sampler, mi.Ray3f(ray), mi.Spectrum(1), mi.Spectrum(0), mi.UInt32(0), mi.Float(1), dr.zeros(mi.Interaction3f), mi.Bool(False),
                 mi.Bool(active))
        state = dr.while_loop(state, lambda *s: s[-1], bounce)
        return state[3], state[7], []


mi.register_bsdf("selvedge_fiber", Fiber)
mi.register_integrator("selvedge_path", Path)
