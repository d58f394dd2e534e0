#!/usr/bin/env bash
# Builds the documentation as a site in target/site (index.html). A link that leads nowhere is an error. Sphinx comes from PyPI into .tools/;
# where it cannot, the exit code is 69.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

tools=.tools/site
if ! cmp -s docs/site/requirements.txt "$tools/requirements.txt"; then
    rm -rf "$tools"
    if ! python3 -m venv "$tools" ||
        ! "$tools/bin/python" -m pip install --quiet --disable-pip-version-check -r docs/site/requirements.txt; then
        echo "Sphinx cannot be installed: no documentation as a site" >&2
        exit 69
    fi
    cp docs/site/requirements.txt "$tools/"
fi
site="${CARGO_TARGET_DIR:-target}/site"
rm -rf "$site"
"$tools/bin/sphinx-build" -q -W --keep-going -c docs/site -d "$site.cache" . "$site"
echo "documentation: $site/index.html"
