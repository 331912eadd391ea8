#!/usr/bin/env bash
# A night's run: ten samples are put into a watched folder, one after the other, and in the morning there are ten results.
# `make night`, or clients/night.sh [FOLDER] after a build. FOLDER (default ./night) keeps the samples, what came of them and
# the daemon's data; running it again continues. Here the samples are synthetic scans and small; the way is that of real ones.
# Environment: NIGHT_SAMPLES (default 10), SELVEDGE_BUILD (default ./build).
set -euo pipefail
cd "$(dirname "$0")/.."
bin=${SELVEDGE_BUILD:-build}/bin
night=${1:-night}
n=${NIGHT_SAMPLES:-10}
weaves=(plain twill31 satin twill knit)
mkdir -p "$night/samples"
night=$(cd "$night" && pwd)

# ---- the service: a daemon that this user alone can reach, and the watcher ----
server=unix:$night/socket
"$bin/selvedged" --data "$night/data" --set server.unix_socket="$night/socket" >"$night/daemon.log" 2>&1 &
daemon=$!
trap 'kill $daemon 2>/dev/null || true; wait' EXIT
for _ in $(seq 100); do "$bin/selvedge" --server "$server" list >/dev/null 2>&1 && break; sleep 0.1; done

# ---- the template: what is done with every sample ----
cat >"$night/template.json" <<'JSON'
{"sample": "", "volume": {"files": ["*.tif"], "voxel_size_um": 2.0}}
JSON

# ---- samples arrive: the files first, the marker last ----
for i in $(seq -w 1 "$n"); do
    sample=$night/samples/sample-$i
    [ -e "$sample/READY" ] && continue
    mkdir -p "$sample"
    weave=${weaves[$((10#$i % ${#weaves[@]}))]}
    "$bin/selvedge-phantom" cloth --weave "$weave" --fibers-per-yarn 7 --seed "$((10#$i))" --out "$night/scanner" >/dev/null
    cp "$night/scanner/scan.tif" "$sample/scan.tif"
    touch "$sample/READY"
    echo "sample-$i: a scan of a $weave cloth has arrived"
done

# ---- the night: the watcher ends when every sample has ended ----
failed=0
"$bin/selvedge" --server "$server" watch-folder "$night/samples" --template "$night/template.json" --once 2>"$night/watcher.log" || failed=1

# ---- the morning ----
for outcome in "$night"/samples/*.selvedge; do
    name=$(basename "$outcome" .selvedge)
    if [ -e "$outcome/reason.txt" ]; then
        echo "$name: $(sed -n 3p "$outcome/reason.txt")"
    else
        echo "$name: $(python3 -c 'import json, sys
g = json.load(open(sys.argv[1]))["geometry"]
print(g.get("n_fiber", "?"), "fibers")' "$outcome/results/result.json"), $outcome/results/report.html"
    fi
done
exit $failed
