#!/usr/bin/env bash
# Measures clean builds into a folder of their own and writes benches/build-times.txt.
set -euo pipefail
cd "$(dirname "$0")/.."
target=$(mktemp -d)
trap 'rm -rf "$target"' EXIT

# Processor and wall seconds of a build: "NN CPU, NN wall".
seconds() {
  local TIMEFORMAT='%U %S %R'
  { time CARGO_TARGET_DIR="$target/$1" cargo build --locked "${@:2}" >/dev/null 2>&1; } 2>&1 \
    | awk '{ printf "%.0f | %.0f", $1 + $2, $3 }'
}

release=$(seconds full --release)
size=$(stat -c %s "$target/full/release/hapdef")
headless=$(seconds headless --release --no-default-features)
small=$(stat -c %s "$target/headless/release/hapdef")
{
  echo "Clean builds on $(nproc) shared cores, by \`benches/build-times.sh\`; the processor seconds are the ones to compare. Reference for the same stack, on two idle cores: 301 s wall, 23 MB stripped."
  echo
  echo "| build | processor seconds | wall seconds | program |"
  echo "|---|---|---|---|"
  echo "| \`cargo build --release\` | $release | $((size / 1000000)) MB |"
  echo "| the same, headless (\`--no-default-features\`) | $headless | $((small / 1000000)) MB |"
} | tee benches/build-times.txt
