#!/usr/bin/env bash
# Passes the tests on a fresh machine: installs what the window tests need where apt-get is at hand (a
# software Vulkan driver, a virtual X server, the libraries a window loads), then runs every test.
# Arguments go to `cargo test`.
set -euo pipefail
cd "$(dirname "$0")/.."

have_adapter() {
  # Any installed driver description will do: hardware or software.
  compgen -G '/usr/share/vulkan/icd.d/*.json' >/dev/null \
    || compgen -G '/etc/vulkan/icd.d/*.json' >/dev/null \
    || [ -n "${VK_ICD_FILENAMES:-}${VK_DRIVER_FILES:-}" ]
}

have_library() {
  compgen -G "/usr/lib/*/$1*" >/dev/null || compgen -G "/usr/lib*/$1*" >/dev/null
}

missing=()
if [ "$(uname)" = Linux ]; then
  have_adapter || missing+=(mesa-vulkan-drivers)
  command -v Xvfb >/dev/null || missing+=(xvfb)
  have_library libXcursor.so.1 || missing+=(libxcursor1)
  have_library libXi.so.6 || missing+=(libxi6)
  have_library libxkbcommon-x11.so.0 || missing+=(libxkbcommon-x11-0)
  have_library libX11-xcb.so.1 || missing+=(libx11-xcb1)
fi

if [ ${#missing[@]} -gt 0 ] && command -v apt-get >/dev/null; then
  root=()
  [ "$(id -u)" = 0 ] || root=(sudo)
  echo "Installing what the window tests need: ${missing[*]}" >&2
  "${root[@]}" apt-get update -q
  "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "${missing[@]}"
fi

exec cargo test --locked "$@"
