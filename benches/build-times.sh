#!/usr/bin/env bash
# Measures clean builds into a folder of their own and writes benches/build-times.txt.
set -euo pipefail
cd "$(dirname "$0")/.."
target=$(mktemp -d)
trap 'rm -rf "$target"' EXIT
seconds() {
  local start end
  start=$(date +%s)
  CARGO_TARGET_DIR="$target" cargo build --locked "$@" >/dev/null 2>&1
  end=$(date +%s)
  echo $((end - start))
}
release=$(seconds --release)
size=$(stat -c %s "$target/release/hapdef")
headless=$(CARGO_TARGET_DIR="$target/headless"; seconds --release --no-default-features)
{
  echo "Clean builds, wall seconds on $(nproc) shared cores, by \`benches/build-times.sh\`. Reference for the same stack: 301 s release, 23 MB stripped."
  echo
  echo "| build | seconds | program |"
  echo "|---|---|---|"
  echo "| release | $release | $((size / 1000000)) MB |"
  echo "| release, headless (\`--no-default-features\`), after the above | $headless | |"
} | tee benches/build-times.txt
