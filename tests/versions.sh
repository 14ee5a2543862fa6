#!/usr/bin/env bash
# tests/versions.sh [RELEASE…] [-- PYTEST ARGUMENTS]
# The tests with the DOLFINx of other releases of Debian, each in a tree of its own; of itself sid, and the quick tests
# of every layer. docs/versions.md tells what came of it.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 1

releases=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do releases+=("$1") && shift; done
[ $# -eq 0 ] || shift
[ ${#releases[@]} -gt 0 ] || releases=(sid)
[ $# -gt 0 ] || set -- tests/{common,constitutive,fem,meshing,results,solvers} tests/discretisation/test_{variants,census,plane_stress}.py \
    tests/scenes/test_{bar,plate,femur_run}.py tests/stepping/test_{time_schemes,stepping}.py tests/baselines tests/cli/test_cli.py

failed=()
for release in "${releases[@]}"; do
    echo "== $release"
    export GROWTHX_DEBIAN=$release
    ./run python -m growthx --version && ./run pytest -q -n auto "$@" || failed+=("$release")
done
[ ${#failed[@]} -eq 0 ] || { echo "== failed with: ${failed[*]}" && exit 1; }
