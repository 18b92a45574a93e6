#!/usr/bin/env bash
# Validates every FMU below a folder, for a pipeline: scripts/validate_fmus.sh FOLDER REPORTS [options of eixo validate].
# REPORTS gets a SARIF file, a page and the text of each FMU, named after its path. Exit code: 0 all pass, 1 findings in
# one at least, 2 one could not be run, 3 the behaviour of one was not tested; the gravest of them: 2, then 1, then 3.
set -uo pipefail
if [ $# -lt 2 ]; then
    echo "usage: $0 FOLDER REPORTS [options of eixo validate]" >&2
    exit 2
fi
folder=$1 reports=$2
shift 2
eixo=${EIXO:-eixo}
if ! [ -d "$folder" ]; then
    echo "$folder: no such folder" >&2
    exit 2
fi
mkdir -p "$reports" || exit 2
worst=0 count=0
# The gravest so far: could not run, findings, not tested, passed.
weigh() { case $1 in 0) echo 0 ;; 3) echo 1 ;; 1) echo 2 ;; *) echo 3 ;; esac; }
while IFS= read -r -d '' fmu; do
    count=$((count + 1))
    name=${fmu#"$folder"/}
    name=${name//\//--}
    name=${name%.fmu}
    "$eixo" validate "$fmu" "$@" --format sarif -o "$reports/$name.sarif" --report "$reports/$name.html"
    code=$?
    case $code in
        0) verdict=passes ;;
        1) verdict="has findings" ;;
        3) verdict="was not tested" ;;
        *) verdict="could not be validated" code=2 ;;
    esac
    echo "$fmu $verdict"
    if [ "$(weigh "$code")" -gt "$(weigh "$worst")" ]; then worst=$code; fi
done < <(find "$folder" -type f -name '*.fmu' -print0 | sort -z)
if [ "$count" -eq 0 ]; then
    echo "$folder: no FMU below it" >&2
    exit 2
fi
echo "$count FMUs, reports in $reports"
exit "$worst"
