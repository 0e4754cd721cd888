#!/bin/sh
# The page's tests, in a copy of this folder: its bundle is rebuilt, and a browser shows made-up characters and what the program writes and
# serves. Skipped where there is no node 20, npm or chromium (sh cmake/dependencies.sh chromium installs the last).
#   run.sh VIEWER WORK KPSA SCENES
set -e
viewer=$1 work=$2
export KPSA=$3 KPSA_SCENES=$4
skip() {
  echo "skipped: $1"
  exit 77
}
command -v npm > /dev/null || skip "there is no npm here"
node -e 'process.exit(parseInt(process.versions.node) < 20 ? 1 : 0)' || skip "node $(node --version) is older than 20"
command -v "${CHROMIUM:-chromium}" > /dev/null || skip "there is no chromium here"
mkdir -p "$work"
rm -rf "$work/src" "$work/tests" "$work/dist"
cp -r "$viewer"/* "$viewer/.npmrc" "$work"
cd "$work"
# A registry that cannot be reached, or lacks a package, is no fault of the page; anything else is
npm ci --loglevel=error > npm.log 2>&1 || {
  cat npm.log
  grep -qE 'ENOTFOUND|ECONNREFUSED|ETIMEDOUT|ECONNRESET|EAI_AGAIN|E403|E404|403 Forbidden|404 Not Found' npm.log || exit 1
  skip "npm cannot reach what package-lock.json names"
}
npm run --silent check
npm test
