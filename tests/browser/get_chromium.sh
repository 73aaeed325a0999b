#!/usr/bin/env bash
# A Chromium for the browser tests: the system's, else Debian's package when root, else
# Playwright's own download. The first argument is the Python of the environment.
set -euo pipefail
python=$1

have_one() {
    for name in chromium chromium-browser google-chrome google-chrome-stable; do
        command -v "$name" >/dev/null && return 0
    done
    return 1
}

if have_one; then
    exit 0
fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "Installing Debian's chromium for the browser tests ..."
    apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium >/dev/null && exit 0
fi
echo "Downloading Playwright's Chromium for the browser tests ..."
"$python" -m playwright install chromium
