#!/usr/bin/env bash
# tests/image.sh [COMMAND…]
# The image of Dockerfile, made and tried where there is no Docker daemon: by Buildah in chroots, as root. Of itself it
# runs the quick tests in it. Whatever is changed in there is gone at its end; the image stays, as localhost/growthx.
# Needs buildah, and mmdebstrap where Docker's registry is out of reach. docs/versions.md tells what came of it.
# IMAGE_VOLUME=FOLDER:FOLDER shows a folder of this machine to the command, to write results to, or compiled forms to be
# kept: ~/.cache/growthx/kernels:/home/growthx/.cache/growthx/kernels.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
[ $# -gt 0 ] || set -- pytest -q -n auto

base=docker.io/library/debian:trixie-slim
export BUILDAH_ISOLATION=chroot

say() { echo "== $*"; }
made=() scratch=$(mktemp -d)
trap 'rm -rf "$scratch"; [ ${#made[@]} -eq 0 ] || buildah rm "${made[@]}" >/dev/null' EXIT
begin() { # IMAGE: a container of it, as $container
    container=$(buildah from --pull=false "$1")
    made+=("$container")
}

if ! buildah inspect --type image "$base" >/dev/null 2>&1 && ! timeout 60 buildah pull "$base"; then
    say "Docker's registry is out of reach: mmdebstrap makes what Dockerfile begins with"
    begin scratch
    mmdebstrap --variant=minbase --quiet trixie "$scratch/root.tar"
    buildah add --quiet "$container" "$scratch/root.tar" /
    buildah config --cmd bash "$container"
    buildah commit --quiet "$container" "$base"
fi

say "building"
buildah build --quiet --layers --pull=never --tag growthx .
begin localhost/growthx
say "$*"
# Buildah asks for no entry point by itself
buildah run ${IMAGE_VOLUME:+--volume "$IMAGE_VOLUME"} "$container" -- /growthx/run "$@"
