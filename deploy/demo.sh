#!/usr/bin/env bash
# The tour: a knee phantom goes through the service and comes back in poses that nobody scanned.
#   deploy/demo.sh PROGRAM [FOLDER]      (./do demo calls this after the build)
set -euo pipefail
kinevox=$(realpath "$1")
out=${2:-demo-output}
angles=(15 37 65)

say() { printf '\n\033[1m%s\033[0m\n' "$*"; }
stop_service() { [ -z "${service:-}" ] || { kill "$service" 2>/dev/null; wait "$service" 2>/dev/null; } || true; }
trap stop_service EXIT

rm -rf "$out"
mkdir -p "$out"/{posed,pictures}

say "1. A knee study with known truth (synthetic, half of the paper's resolution)"
"$kinevox" phantom knee --scale half --seed 7 --out "$out/study"

say "2. The service, on its embedded defaults"
"$kinevox" serve --data "$out/data" --listen 127.0.0.1:0 --json >"$out/service.json" 2>"$out/service.log" &
service=$!
for _ in $(seq 100); do [ -s "$out/service.json" ] && break; sleep 0.1; done
url=$(python3 -c 'import json, sys; print(json.loads(open(sys.argv[1]).readline())["url"])' "$out/service.json")
echo "listening on $url"

say "3. Upload over HTTP and build: bones, joints, weights, registration, examples"
"$kinevox" submit "$out/study/study.json" --server "$url" --wait --json >"$out/model.json"
model=$(python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["id"])' "$out/model.json")
echo "model $model"

say "4. Posed volumes at flexions that were not scanned"
for angle in "${angles[@]}"; do
  curl --silent --show-error --fail --output "$out/posed/flexion$angle.nii.gz" \
    --write-out "flexion ${angle} degrees: %{size_download} bytes in %{time_total} s\n" \
    "$url/v1/models/$model/volume?tibia.flexion=$angle&format=nii.gz"
done
curl --silent --show-error --fail --output /dev/null --write-out "the last one again, from the cache: %{time_total} s\n" \
  "$url/v1/models/$model/volume?tibia.flexion=${angles[-1]}&format=nii.gz"

say "5. The paper's table for this model, against the phantom's truth"
"$kinevox" evaluate "$out/data/models/$model" --truth "$out/study" --pictures "$out/pictures"
"$kinevox" slices "$out"/posed/flexion*.nii.gz --out "$out/pictures/posed.png"

say "Where to look"
cat <<TEXT
  $out/pictures/     slices: template, scan, VBD, registered, difference; posed.png: the poses fetched above
  $out/posed/        posed volumes, for any NIfTI viewer
  $out/study/        the phantom: scans, bones, truth
Next: ./do serve, then "kinevox submit YOUR/study.json --server http://127.0.0.1:8080 --wait"; README.md says how a study looks.
For research, not for diagnosis.
TEXT
