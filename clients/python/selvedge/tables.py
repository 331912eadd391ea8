"""Results as flat tables and as words."""
from __future__ import annotations

import math
from typing import Any, Iterable, Mapping, Optional, Sequence

COLOR = ("r", "g", "b")


def percent(share: Optional[float], se: Optional[float] = None) -> str:
    """Write a relative error as words: "4.71 +- 0.10 %", or "below 1.1 %" where it is less than two standard errors."""
    if share is None or not math.isfinite(share):
        return "-"
    if se is None or not math.isfinite(se) or se <= 0:
        return f"{100 * share:.3g} %"
    if share < 2 * se:
        bound = 100 * (share + 2 * se)
        unit = 10.0 ** (math.floor(math.log10(bound)) - 1)
        up = unit * math.ceil(bound / unit - 1e-9)
        return f"below {up:.{max(0, -round(math.log10(unit)))}f} %"
    first = max(0, -math.floor(math.log10(100 * se)))
    n = first + 1 if 100 * se * 10**first < 1.95 and 100 * se < 10 else first
    return f"{100 * share:.{n}f} +- {100 * se:.{n}f} %"


def with_error(value: Optional[float], se: Optional[float]) -> str:
    """Write a value with as many digits as its standard error has meaning."""
    if value is None:
        return "-"
    if not se or not math.isfinite(se):
        return f"{value:.4g}"
    n = min(8, max(0, 1 - math.floor(math.log10(se))))
    return f"{value:.{n}f} +- {se:.{n}f}"


def flat(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row of numbers, texts and truth values: a color becomes three columns (measured_r, ...), a list of texts one text
    between blanks; other members that are lists or objects are left out."""
    out: dict[str, Any] = {}
    for key, value in row.items():
        if isinstance(value, (str, int, float, bool)) or value is None:
            out[key] = value
        elif isinstance(value, list) and len(value) == 3 and all(isinstance(x, (int, float)) for x in value):
            out.update({f"{key}_{c}": x for c, x in zip(COLOR, value)})
        elif isinstance(value, list) and all(isinstance(x, str) for x in value):
            out[key] = " ".join(value)
    return out


def batch_row(sample: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row of a batch's table: the columns of a sample and, for each parameter, NAME, NAME_se and NAME_determined."""
    out = {key: value for key, value in flat(sample).items() if key not in ("parameters", "error")}
    for p in sample["parameters"]:
        out.update({p["name"]: p["value"], f"{p['name']}_se": p["standard_error"], f"{p['name']}_determined": p["determined"]})
    out["error"] = (sample["error"] or {}).get("text")
    return out


def to_pandas(rows: Sequence[Mapping[str, Any]], columns: Iterable[str] = ()) -> Any:
    """Return a pandas.DataFrame of the rows; `columns` come first. Raises ImportError where pandas is not installed."""
    try:
        import pandas
    except ImportError:
        raise ImportError("to_pandas() needs pandas: pip install pandas (Debian: python3-pandas); table() gives the same rows without it") from None
    frame = pandas.DataFrame(list(rows))
    first = [c for c in columns if c in frame.columns]
    return frame[first + [c for c in frame.columns if c not in first]]
