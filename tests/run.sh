#!/usr/bin/env bash
# Passes the tests on a fresh machine: installs a software Vulkan driver where there is no graphics
# adapter and apt-get is at hand, then runs every test. Arguments go to `cargo test`.
set -euo pipefail
cd "$(dirname "$0")/.."

have_adapter() {
  # Any installed driver description will do: hardware or software.
  compgen -G '/usr/share/vulkan/icd.d/*.json' >/dev/null \
    || compgen -G '/etc/vulkan/icd.d/*.json' >/dev/null \
    || [ -n "${VK_ICD_FILENAMES:-}${VK_DRIVER_FILES:-}" ] \
    || [ "$(uname)" != Linux ]
}

if ! have_adapter && command -v apt-get >/dev/null; then
  root=()
  [ "$(id -u)" = 0 ] || root=(sudo)
  echo "No graphics adapter found: installing a software Vulkan driver (mesa-vulkan-drivers)" >&2
  "${root[@]}" apt-get update -q
  "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends mesa-vulkan-drivers
fi

exec cargo test --locked "$@"
