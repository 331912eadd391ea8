#!/usr/bin/env bash
# Runs the main job end to end on a synthetic sample: `make demo`, or clients/demo.sh [--fresh] [--camera] after a build.
# --camera: the photographs are raw files of a simulated camera (`make demo-camera`).
# Environment: DEMO_PORT (a fixed port), DEMO_DIR (folder, default ./demo, with --camera ./demo-camera), SELVEDGE_BUILD
# (default ./build).
set -euo pipefail
cd "$(dirname "$0")/.."

fresh=no
camera=no
for word in "$@"; do
    case "$word" in
    --fresh) fresh=yes ;;
    --camera) camera=yes ;;
    *)
        echo "usage: $0 [--fresh] [--camera]    --fresh: make a new sample and run the fit again; --camera: from raw files" >&2
        exit 2
        ;;
    esac
done

here=$PWD
build=${SELVEDGE_BUILD:-build}
[[ $build = /* ]] || build=$here/$build
bin=$build/bin
name=demo
[ "$camera" = no ] || name="demo-camera"
demo=${DEMO_DIR:-$here/$name}
sample=$demo/sample
mkdir -p "$demo"
demo=$(cd "$demo" && pwd)
started=$(date +%s.%N)

# Parameters that the sample is made with. The fit does not see them.
truth=(--param 'C_R=0.06,0.05,0.08' --param 'C_TT=0.72,0.55,0.35' --param beta_R=4 --param beta_TT=20 --param gamma_TT=18)
title="twill phantom"

say() { printf '\n== %s\n' "$*"; }
fail() { printf 'error: %s\n' "$*" >&2; exit 1; }

for program in selvedged selvedge selvedge-worker selvedge-phantom selvedge-camera; do
    [ -x "$bin/$program" ] || fail "$bin/$program is missing: run make first"
done
command -v python3 >/dev/null || fail "python3 is missing: run make deps"

# ---- the daemon: one that an earlier demo left running, or a new one ----
daemon_pid=
keep_daemon=no
# shellcheck disable=SC2317 # the trap calls it
stop_daemon() {
    if [ -n "$daemon_pid" ] && [ "$keep_daemon" = no ]; then
        kill "$daemon_pid" 2>/dev/null || true
        wait "$daemon_pid" 2>/dev/null || true
        rm -f "$demo/daemon.pid" "$demo/daemon.url"
    fi
}
trap stop_daemon EXIT
trap 'echo; echo "Stopped. Finished work is kept; run the demo again to continue."; exit 130' INT TERM

port_is_free() { ! (exec 3<>"/dev/tcp/127.0.0.1/$1") 2>/dev/null; }

find_port() {
    if [ -n "${DEMO_PORT:-}" ]; then
        port_is_free "$DEMO_PORT" || fail "port $DEMO_PORT (DEMO_PORT) is in use"
        echo "$DEMO_PORT"
        return
    fi
    for port in $(seq 7878 7977); do
        if port_is_free "$port"; then echo "$port"; return; fi
    done
    fail "no free port in 7878..7977; set DEMO_PORT"
}

start_daemon() {
    local pid url
    if [ -s "$demo/daemon.pid" ] && [ -s "$demo/daemon.url" ]; then
        pid=$(cat "$demo/daemon.pid")
        url=$(cat "$demo/daemon.url")
        if kill -0 "$pid" 2>/dev/null && "$bin/selvedge" --server "$url" list >/dev/null 2>&1; then
            export SELVEDGE_SERVER=$url
            echo "selvedged is still running at $url (process $pid)"
            return
        fi
    fi
    local port
    port=$(find_port) || exit 1
    export SELVEDGE_SERVER=http://127.0.0.1:$port
    # its own session, so that Ctrl-C here does not end it in the middle of a reply
    setsid "$bin/selvedged" --data "$demo/daemon" --port "$port" >>"$demo/daemon.log" 2>&1 </dev/null &
    daemon_pid=$!
    for _ in $(seq 100); do
        if "$bin/selvedge" list >/dev/null 2>&1; then
            echo "$daemon_pid" >"$demo/daemon.pid"
            echo "$SELVEDGE_SERVER" >"$demo/daemon.url"
            echo "selvedged listens at $SELVEDGE_SERVER, data in $demo/daemon"
            return
        fi
        kill -0 "$daemon_pid" 2>/dev/null || break
        sleep 0.1
    done
    tail -n 20 "$demo/daemon.log" >&2
    fail "selvedged did not start; the end of its log is above"
}

# ---- the sample ----
render() {
    "$bin/selvedge-phantom" photograph --fibers "$sample/truth.hair" --seed 11 --noise 0.005 "${truth[@]}" --out "$@" >/dev/null
}

make_sample() {
    if [ "$fresh" = yes ]; then rm -rf "$sample" "$demo/job-id" "$demo/results" "$demo/summary.json"; fi
    if [ -s "$sample/job.json" ]; then
        echo "using the sample in $sample (--fresh makes a new one)"
        return
    fi
    rm -rf "$sample"
    mkdir -p "$sample"
    echo "cloth: a twill of 152 fibers, scanned at 2 um with noise"
    "$bin/selvedge-phantom" cloth --weave twill --seed 7 --out "$sample" >/dev/null
    echo "photographs: 16 to fit and 24 held out, rendered with known parameters (takes half a minute)"
    if [ "$camera" = no ]; then
        render "$sample" --paths 131072 --px 64
    else
        # more than the crop, and the blur of the lens
        render "$sample/rendered" --paths 204800 --px 80 --crop-cm 1.25 --blur-mm 0.12
        echo "camera: three raw files of each, with times that are 5 % off the stated ones, a color chart under a lamp that"
        echo "falls by 20 %, dark and flat frames (takes half a minute)"
        "$bin/selvedge-phantom" camera --photographs "$sample/rendered" --out "$sample" --seed 5 --exposure-error 0.05 --chart-fall 0.2
        "$bin/selvedge" calibrate-camera --dark "$sample"/dark-*.dng --flat "$sample"/flat-*.dng --out "$sample/noise.json"
    fi
    python3 clients/demo_report.py document "$sample" "$title"
}

# ---- the job ----
run_job() {
    local id state=
    if [ -s "$demo/job-id" ]; then
        id=$(cat "$demo/job-id")
        state=$("$bin/selvedge" status "$id" --json 2>/dev/null | python3 -c 'import json,sys; print(json.load(sys.stdin)["state"])' 2>/dev/null) || state=
    fi
    case "$state" in
    succeeded) echo "job $id of an earlier run has succeeded; this is its result (--fresh runs it again)" ;;
    queued | running | paused) echo "job $id of an earlier run continues"; "$bin/selvedge" watch "$id" ;;
    failed | cancelled) echo "job $id of an earlier run has $state; trying again"; "$bin/selvedge" retry "$id"; "$bin/selvedge" watch "$id" ;;
    draft) "$bin/selvedge" submit --resume "$id" "$sample/job.json" --watch ;;
    *)
        # the id is stored before the upload, so that after an interruption the demo finds its job again
        "$bin/selvedge" submit "$sample/job.json" --id-file "$demo/job-id" --watch
        id=$(cat "$demo/job-id")
        ;;
    esac
    job=$id
    "$bin/selvedge" results "$id" --out "$demo/results" >/dev/null
    [ "$state" = succeeded ] && [ -s "$demo/summary.json" ] && new=no || new=yes
}

main() {
    say "1. Daemon"
    start_daemon
    say "2. Sample"
    make_sample
    say "3. Upload, reconstruction, fit"
    run_job
    say "4. Result"
    wall=$(python3 -c "import sys,time; print(round(time.time() - float(sys.argv[1]), 1))" "$started")
    [ "$new" = yes ] || wall=
    python3 clients/demo_report.py summary "$sample/truth.json" "$demo/results/result.json" "$demo/summary.json" "$wall"
    if [ "$camera" = yes ]; then
        python3 clients/demo_report.py camera "$sample/truth.json" "$demo/results/result.json" "$demo/summary.json" "$here/demo/summary.json"
    fi

    cat <<END

results    $demo/results (result.json, fibers, volumes, renderings)
summary    $demo/summary.json
dashboard  $SELVEDGE_SERVER/#$job
END
    if [ -z "$daemon_pid" ]; then
        echo "selvedged keeps running; stop it with: kill $(cat "$demo/daemon.pid")"
    elif [ -t 0 ]; then
        keep_daemon=yes
        echo "selvedged keeps running for the dashboard; stop it with: kill $daemon_pid"
    else
        echo "selvedged has been stopped; start it again with: $bin/selvedged --data $demo/daemon --port ${SELVEDGE_SERVER##*:}"
    fi
}

main
exit
