#!/usr/bin/env bash
# scripts/slurm/submit hands Slurm all missing shards and no other, in ranges, in arrays that Slurm takes, with a program
# and a Slurm that only take notes.
#   slurm_submit_test.sh SOURCE_DIR
set -euo pipefail
submit=$1/scripts/slurm/submit
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
mkdir bin
export PATH=$work/bin:$PATH
cat >bin/isohf <<'SH'
#!/bin/bash
[[ $1 != merge ]] || cat "$WORK/missing"
[[ $1 != convert ]] || echo "$@" >>"$WORK/converted"
SH
cat >bin/scontrol <<'SH'
#!/bin/bash
echo "MaxArraySize            = $MOST"
SH
# Says which job it is, and runs the first and the last of an array.
cat >bin/sbatch <<'SH'
#!/bin/bash
printf '%s\n' "$@" >>"$WORK/arguments"
job=$(($(grep -c -- --wrap "$WORK/arguments")))
[[ $job != "${FAILS:-}" ]] || exit 1
for word; do [[ $word == --array=* ]] && list=${word#*=}; done
if [[ -n ${list:-} ]]; then
  for number in "${list%%[-,]*}" "${list##*[-,]}"; do SLURM_ARRAY_TASK_ID=$number bash -c "${@: -1}"; done
fi
echo "$job;cluster"
SH
echo 'echo "$@" >>"$WORK/cancelled"' | cat <(echo '#!/bin/bash') - >bin/scancel
chmod +x bin/*
export WORK=$work MOST=1001
fail() { echo "slurm_submit_test: $1" >&2; exit 1; }
plan() { printf '{"shard_ends": [\n %s]}\n' "$(seq -f %.1f -s ', ' "$1")" >land.plan; }
run() { rm -f arguments converted cancelled; "$submit" land.plan shards land.isohf "$@"; }

# Few: ranges as they are, what is damaged goes, what is whole stays.
plan 16
echo 1-5,7,9-12 >missing
mkdir shards
touch shards/part-7.isohf shards/part-8.isohf
run --time=1 >said
grep -qxF 'array 1: shards 1-5,7,9-12 of 16' said || fail "few: $(cat said)"
grep -qx -- '--array=1-5,7,9-12' arguments || fail "few: no ranges"
grep -qx -- '--dependency=afterok:1' arguments || fail "few: the merge waits for another"
(($(grep -cx -- --time=1 arguments) == 2)) || fail "few: options are not handed on"
[[ ! -e shards/part-7.isohf && -e shards/part-8.isohf ]] || fail "few: files"
grep -q -- '--shard 12/16 .*/part-12.isohf' converted || fail "few: $(cat converted)"

# None: the merge alone.
echo >missing
run >said
[[ $(cat said) == "merge 1: $work/land.isohf" ]] || fail "none: $(cat said)"

# Every second of 40,001, and a run of them at the end: more than an argument holds, and than an array may number.
plan 40001
{ seq -s , 1 2 39001; echo ,39500-40001; } | tr -d '\n' >missing
for MOST in 1001 100001; do
  run >said
  # Lists and the names of logs, in turn: a list's numbers follow the digits before % in the name.
  sed -n 's/^--array=//p; s/^--output=.*shard-\(.*\)a.log/\1/p' arguments | awk -v most="$MOST" '
    NR % 2 { list = $0; next }
    { split($0, name, "%"); begin = name[1] * 10 ^ name[2]; ranges = split(list, range, ",") }
    { for (i = 1; i <= ranges; ++i) {
        ends = split(range[i], end, "-")
        if (end[ends] >= most) { print "an array numbers " end[ends]; exit }
        for (k = end[1]; k <= end[ends]; ++k) print begin + k } }' >found
  { seq 1 2 39001; seq 39500 40001; } | cmp - found || fail "$MOST: not the shards that are missing"
  jobs=$(grep -c '^--array=' arguments)
  grep -qx -- "--dependency=afterok$(seq -f :%g -s '' "$jobs")" arguments || fail "$MOST: the merge waits for others"
  grep -q -- "--shard 40001/40001 .*/part-40001.isohf" converted || fail "$MOST: the last is another"
done

# An array that is refused takes those before it along.
MOST=1001
if FAILS=3 run >said 2>&1; then fail "refused: ended with 0"; fi
[[ $(cat cancelled) == "1 2" ]] || fail "refused: $(cat cancelled) cancelled"
