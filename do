#!/usr/bin/env bash
# The one script of this repository; `./do` alone lists what it can do.
set -euo pipefail
cd "$(dirname "$0")"

usage() {
  cat <<'TEXT'
./do demo            build, make a knee phantom, start the service, build a model over HTTP, fetch posed volumes, show where to look
./do test [FILTER]   build and run the tests (PRESET=asan or ubsan: with sanitizers); FILTER as in ctest -R
./do serve [ARGS]    build and start the service (kinevox serve ARGS)
./do build           build only; the program is build/bin/kinevox (PRESET=release|debug|asan|ubsan|tsan)
./do soak            the long fault tests: 200 kills, 10,000 damaged uploads, a 2 GiB upload, a disk that fills up, 400 slow clients, made-up requests (an hour or more)
./do tsan            core, kernel, queue, API and server tests and a half-scale knee's build under the thread sanitizer
./do bench [FILTER]  build and run the benchmarks
./do fmt             format all sources        ./do tidy    static checks of changed sources (all: ./do tidy all)
./do setup           install what is needed (demo, test, serve and build do it themselves)
./do clean           remove build folders and demo output
TEXT
}

preset=${PRESET:-release}
build_folder() { [ "$preset" = release ] && echo build || echo "build-$preset"; }
sources() { git ls-files 'core/*' 'kernels/*' 'pipeline/*' 'storage/*' 'api/*' 'server/*' 'cli/*' 'tests/*' | grep -E '\.(cpp|h|cl)$'; }

setup() { deploy/setup-debian.sh "$@"; }

build() {
  setup
  [ -f "$(build_folder)/build.ninja" ] || cmake --preset "$preset" >"/tmp/kinevox-configure-$$.log" 2>&1 ||
    { cat "/tmp/kinevox-configure-$$.log" >&2; exit 1; }
  rm -f "/tmp/kinevox-configure-$$.log"
  cmake --build "$(build_folder)" "$@"
}

run_tests() {
  build
  setup ffmpeg
  local filter=()
  [ $# = 0 ] || filter=(-R "$1")
  # Suppressions name foreign code only: PoCL and its LLVM keep memory until the process ends, ITK forgets NIfTI file names, GDCM what it could not decode.
  LSAN_OPTIONS="suppressions=$PWD/tests/support/lsan.supp:print_suppressions=0" \
    ctest --test-dir "$(build_folder)" --output-on-failure --parallel "${JOBS:-2}" "${filter[@]}"
}

soak() {
  build --target cli_tests kinevox
  setup slowhttptest wrk
  local program
  program="$(build_folder)/bin/kinevox"
  if [ $# = 0 ]; then
    tests/soak/slow_clients.sh "$program"
    tests/soak/fuzz.sh "$program"
  fi
  KVX_SOAK=1 "$(build_folder)/bin/cli_tests" --gtest_filter="${1:-Faults.*}"
}

# Without the pipeline's own tests, which are many times slower so: a model is built instead, of a phantom that the release build
# makes. What OpenCL drivers do is not seen: they are not built for it.
tsan() {
  export TSAN_OPTIONS="suppressions=$PWD/tests/support/tsan.supp:halt_on_error=1"
  local study programs room
  study=$(mktemp -d)
  trap "rm -rf '$study'" EXIT
  preset=release
  build --target kinevox
  "$(build_folder)/bin/kinevox" phantom knee --scale half --quiet --out "$study"
  preset=tsan
  build --target core_tests kernels_tests storage_tests api_tests server_tests kinevox
  programs="$(build_folder)/bin"
  for room in core kernels storage api server; do "$programs/${room}_tests" --gtest_brief=1; done
  "$programs/kinevox" build "$study/study.json" --out "$study/model"
}

tidy() {
  setup clang-tidy
  build --target kvx_core >/dev/null
  local files
  if [ "${1:-}" = all ]; then files=$(sources | grep '\.cpp$'); else
    files=$( (git diff --name-only HEAD; git diff --name-only '@{upstream}' 2>/dev/null || true) | grep '\.cpp$' | sort -u || true)
  fi
  [ -z "$files" ] && { echo "no changed sources"; return; }
  xargs -P 2 -n 1 clang-tidy --quiet --extra-arg=-Wno-unknown-warning-option -p "$(readable_commands)" <<<"$files"
}

# GCC's precompiled headers are nothing to clang: a folder with compile commands that include their sources.
readable_commands() {
  local folder header
  folder=$(build_folder)
  for header in $(find "$folder" -name cmake_pch.hxx); do cp "$header" "${header%.hxx}_source.hxx"; done
  mkdir -p "$folder/tidy"
  sed 's#-Winvalid-pch -include \([^ ]*\)/cmake_pch\.hxx#-include \1/cmake_pch_source.hxx#' \
    "$folder/compile_commands.json" >"$folder/tidy/compile_commands.json"
  echo "$folder/tidy"
}

case "${1:-}" in
  demo) shift; build >&2; exec deploy/demo.sh "$(build_folder)/bin/kinevox" "$@" ;;
  test) shift; run_tests "$@" ;;
  serve) shift; build --target kinevox >&2; exec "$(build_folder)/bin/kinevox" serve "$@" ;;
  build) shift; build "$@" ;;
  soak) shift; soak "$@" ;;
  tsan) tsan ;;
  bench) shift; build --target kvx_bench >&2; exec "$(build_folder)/bin/kvx_bench" ${1:+--benchmark_filter="$1"} ;;
  fmt) setup clang-format; sources | xargs clang-format -i ;;
  tidy) shift; tidy "$@" ;;
  setup) shift; setup "$@" ;;
  clean) rm -rf build build-debug build-asan build-ubsan build-tsan demo-output ;;
  ""|help|-h|--help) usage ;;
  *) echo "./do knows no '$1'" >&2; usage >&2; exit 2 ;;
esac
