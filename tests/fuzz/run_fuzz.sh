#!/usr/bin/env bash
# run_fuzz.sh BUILD SECONDS [PARSER...]: runs each harness for SECONDS from newly made seeds. Ends with status 1 if
# there is a finding, whose input stays in BUILD/fuzz/findings. A finding is a crash, a sanitizer report, a run over 10
# s, or a single allocation over 512 MB.
set -euo pipefail
export ASAN_OPTIONS=quarantine_size_mb=16:malloc_context_size=8:allocator_release_to_os_interval_ms=500 # freed memory must not look like use
build=$1 seconds=$2
shift 2
work=$build/fuzz
mkdir -p "$work/findings" "$work/corpus"
"$build/tests/fuzz/make_fuzz_seeds" "$work/seeds"
mkdir -p "$work/seeds/job_document"
cp config/examples/*.json "$work/seeds/job_document/"
if [ $# -eq 0 ]; then
    for program in "$build"/tests/fuzz/fuzz_* "$build"/tests/fuzz/*/fuzz_*; do set -- "$@" "${program##*/fuzz_}"; done
fi
bad=0
for parser; do
    mkdir -p "$work/corpus/$parser" "$work/seeds/$parser" # a parser may have no seeds
    dictionary=()
    [ ! -f "tests/fuzz/$parser.dict" ] || dictionary=("-dict=tests/fuzz/$parser.dict")
    program=$(find "$build/tests/fuzz" -type f -name "fuzz_$parser")
    if nice "$program" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=1500 -malloc_limit_mb=512 -max_len=16384 \
        -artifact_prefix="$work/findings/$parser-" -print_final_stats=1 "${dictionary[@]}" \
        "$work/corpus/$parser" "$work/seeds/$parser" >"$work/$parser.log" 2>&1; then
        echo "fuzz $parser: ok, $(sed -n 's/^stat::number_of_executed_units: *//p' "$work/$parser.log") inputs in $seconds s"
    else
        bad=1
        echo "fuzz $parser: FINDING, see $work/$parser.log"
        grep -m1 -E 'ERROR: |runtime error' "$work/$parser.log" || true
    fi
done
exit $bad
