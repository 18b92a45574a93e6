#!/usr/bin/env bash
# Makes logs of three machines over six days, for the README's example of many traces: fleet_example.sh FOLDER
# The press loses stiffness, the mill has friction, the lathe's friction grows; one log of the press is cut off.
set -euo pipefail
folder=${1:?the folder to make}
eixo=${EIXO:-eixo}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$eixo" export "$scratch/axis.fmu" >/dev/null
"$eixo" excite -o "$scratch/u.csv" --kind odd --periods 2 >/dev/null
for machine in press mill lathe; do
    mkdir -p "$folder/$machine"
    printf 'name = "%s X"\n\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n' "$machine" \
        >"$folder/$machine/axis.toml"
    for day in 0 1 2 3 4 5; do
        case $machine in
            press) set=$(awk "BEGIN { printf \"K=%.7f\", 0.0176 * (1 - 0.012 * $day) }") ;;
            mill) set=coulomb_motor.level=0.004 ;;
            lathe) set=$(awk "BEGIN { printf \"coulomb_motor.level=%.6f\", 0.001 * (1 + 0.3 * $day) }") ;;
        esac
        "$eixo" simulate "$scratch/axis.fmu" --input "$scratch/u.csv" --set "$set" --outputs theta1,theta2 \
            --noise theta1=2e-5,theta2=2e-5 --seed $((day + 1)) -o "$folder/$machine/2026-03-0$((day + 1)).csv" >/dev/null
    done
done
printf 'time,T,theta1\n0,1\n' >"$folder/press/2026-03-07.csv"
