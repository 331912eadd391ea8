"""What two runs of the same fit must have in common, read from their job folders."""
import json
import os


def read_json(folder, name):
    with open(os.path.join(folder, name)) as f:
        return json.load(f)


def outcome(folder):
    """Returns (result, series) without times, which are all that may differ."""
    result = read_json(folder, "results/result.json")
    for key in ("fit_wall_s", "stages"):
        result.pop(key)
    for model in result["models"]:
        model.pop("fit_wall_s")
    (result["radius"] or {}).pop("wall_s", None)
    with open(os.path.join(folder, "series.rec")) as f:
        series = [json.loads(line[9:]) for line in f]
    for record in series:
        record.pop("wall_s")
    return result, series
