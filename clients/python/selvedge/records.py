"""The server's answers, as dataclasses. Each keeps its JSON object in `raw`, which has every member of
docs/api.md and docs/file-formats.md; the attributes are the members that most programs need."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Mapping, Optional

from .tables import flat, percent, to_pandas, with_error

ENDED = ("succeeded", "failed", "cancelled")


@dataclass(frozen=True)
class Verdict:
    """Whether a result can be used: "good", "good_but_undetermined", "pictures_only" or "does_not_describe_this_cloth" ("usable" in
    results of older versions)."""
    code: str
    words: str
    text: str
    reservations: tuple[str, ...]

    @classmethod
    def of(cls, raw: Optional[Mapping[str, Any]]) -> Optional[Verdict]:
        if not raw:
            return None
        return cls(raw["code"], raw.get("words", ""), raw.get("text", ""), tuple(r["text"] for r in raw.get("reservations", ())))


@dataclass(frozen=True)
class JobError:
    """Why a job failed; `field` names the part of the job document at fault, or is ""."""
    code: str
    field: str
    text: str


@dataclass(frozen=True)
class JobState:
    """A job at one moment. Its text is one line of progress."""
    id: str
    sample: str
    state: str
    stage: Optional[str]
    fraction: float
    eta_s: Optional[float]
    message: str
    objective: Optional[float]
    objective_se: Optional[float]
    step: Optional[int]
    warnings: tuple[str, ...]
    verdict: Optional[Verdict]
    error: Optional[JobError]
    created_unix_s: float
    finished_unix_s: Optional[float]
    raw: Mapping[str, Any] = field(repr=False)

    @classmethod
    def of(cls, raw: Mapping[str, Any]) -> JobState:
        error = raw.get("error")
        return cls(raw["id"], raw["sample"], raw["state"], raw["stage"], raw["fraction"], raw["eta_s"], raw["message"], raw["objective"],
                   raw["objective_se"], raw["step"], tuple(raw["warnings"]), Verdict.of(raw.get("verdict")),
                   JobError(error["code"], error["field"], error["text"]) if error else None, raw["created_unix_s"], raw["finished_unix_s"], raw)

    @property
    def ended(self) -> bool:
        return self.state in ENDED

    def __str__(self) -> str:
        line = f"{self.state} {self.stage or ''} {100 * self.fraction:.0f} %"
        if self.objective is not None:
            line += f"  squared errors {self.objective:.5g} +- {self.objective_se or 0:.2g}"
        return line


@dataclass(frozen=True, repr=False)
class Parameter:
    """A fitted parameter, in the units of files (degrees where unit is "deg"). `set`: its group of fibers, or None. `meaning`: the
    quantity, in one sentence ("" in results of older versions)."""
    name: str
    unit: str
    set: Optional[str]
    value: Optional[float]
    standard_error: Optional[float]
    lower: Optional[float]
    upper: Optional[float]
    determined: bool
    at_bound: Optional[str]
    fixed: bool
    meaning: str
    raw: Mapping[str, Any] = field(repr=False)

    @classmethod
    def of(cls, raw: Mapping[str, Any]) -> Parameter:
        return cls(raw["name"], raw.get("unit", ""), raw.get("set"), raw.get("value"), raw.get("standard_error"), raw.get("lower"), raw.get("upper"),
                   bool(raw.get("determined", True)), raw.get("at_bound"), bool(raw.get("fixed", False)), raw.get("meaning") or "", raw)

    def __repr__(self) -> str:
        remarks = [text for holds, text in ((self.fixed, "fixed"), (self.at_bound is not None, f"at its {self.at_bound} bound"),
                                            (not self.determined and not self.fixed, "not determined")) if holds]
        value = f"{with_error(self.value, self.standard_error)} {self.unit}".rstrip()
        return f"{self.name} = {value}" + (f" ({', '.join(remarks)})" if remarks else "")


@dataclass(frozen=True)
class Model:
    """One of the models that a job has fitted."""
    id: str
    best: bool
    fit_rel_rms: Optional[float]
    heldout_rel_rms: Optional[float]
    parameters: tuple[Parameter, ...]
    raw: Mapping[str, Any] = field(repr=False)

    @classmethod
    def of(cls, raw: Mapping[str, Any]) -> Model:
        return cls(raw["id"], bool(raw.get("best")), raw.get("fit_rel_rms", raw.get("rel_rms")), raw.get("heldout_rel_rms"),
                   tuple(Parameter.of(p) for p in raw.get("parameters", ())), raw)


@dataclass(frozen=True, repr=False)
class Result:
    """result.json. Jobs that end with the geometry have no parameters and no errors. The models of a job with the profile
    of a fiber have their relative residual as fit_rel_rms. Printed, it is a verdict, the errors and a line for each parameter."""
    verdict: Optional[Verdict]
    converged: Optional[bool]
    fit_rel_rms: Optional[float]
    heldout_rel_rms: Optional[float]
    parameters: tuple[Parameter, ...]
    models: tuple[Model, ...]
    warnings: tuple[str, ...]
    raw: Mapping[str, Any] = field(repr=False)

    @classmethod
    def of(cls, raw: Mapping[str, Any]) -> Result:
        return cls(Verdict.of(raw.get("verdict")), raw.get("converged"), raw.get("fit_rel_rms"), raw.get("heldout_rel_rms"),
                   tuple(Parameter.of(p) for p in raw.get("parameters") or ()),
                   tuple(Model.of(m) for m in raw.get("models") or (raw.get("profile") or {}).get("models") or ()), tuple(raw.get("warnings") or ()), raw)

    def parameter(self, name: str, set: Optional[str] = None) -> Parameter:
        """Return one parameter. Raises KeyError."""
        for p in self.parameters:
            if p.name == name and set in (None, p.set):
                return p
        raise KeyError(name)

    def table(self, what: str = "parameters") -> list[dict[str, Any]]:
        """Return "parameters" or "rows" (measured and rendered radiances) as flat rows: dicts of numbers and texts. Raises KeyError for
        another word."""
        if what not in ("parameters", "rows"):
            raise KeyError(f"a result has no table '{what}': it has 'parameters' and 'rows'")
        return [flat(row) for row in self.raw.get(what) or ()]

    def to_pandas(self, what: str = "parameters") -> Any:
        """Return the same table as a pandas.DataFrame. Raises ImportError where pandas is not installed."""
        return to_pandas(self.table(what), ("name", "set", "value", "standard_error", "unit"))

    def __repr__(self) -> str:
        lines = [f"Result: {self.verdict.words if self.verdict else 'without a verdict'}"]
        errors = [f"{percent(self.raw[key], self.raw.get(key + '_se'))} {words}" for key, words in (("heldout_rel_rms", "held out"), ("fit_rel_rms", "fitted"))
                  if self.raw.get(key) is not None]
        return "\n  ".join(lines + (["relative error " + ", ".join(errors)] if errors else []) + [repr(p) for p in self.parameters])


@dataclass(frozen=True)
class ResultFile:
    """A file among the results; `path` is relative to their folder."""
    path: str
    size: int
    url: str

    @classmethod
    def of(cls, raw: Mapping[str, Any]) -> ResultFile:
        return cls(raw["path"], raw["size"], raw["url"])


@dataclass(frozen=True)
class Version:
    """The result of one run of a job. `current`: it is the job's present result."""
    version: int
    current: bool
    finished_unix_s: float
    verdict: Optional[Verdict]
    raw: Mapping[str, Any] = field(repr=False)

    @classmethod
    def of(cls, raw: Mapping[str, Any]) -> Version:
        return cls(raw["version"], raw["current"], raw["finished_unix_s"], Verdict.of(raw.get("verdict")), raw)


@dataclass(frozen=True)
class Progress:
    """How far an upload or a download is: bytes over all files. `phase`: "checking" (hashes), "uploading", "downloading"."""
    phase: str
    name: str
    n_done: int
    n_total: int
