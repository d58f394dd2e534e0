#!/usr/bin/env bash
# Builds what is released, checks it, and puts it into a folder:
#
#     scripts/release.sh [--no-wheel] [FOLDER]          # target/release-files without one
#
#   flexbody-VERSION-x86_64-linux.tar.gz    the program, static: it runs on every Linux of this processor, whatever its C library; with a
#                                           Dockerfile for an image of it
#   flexbody_VERSION_amd64.deb              the same program as a package of Debian (packaging/debian.sh)
#   flexbody-VERSION-*.conda                the same program as a package of conda (packaging/conda)
#   flexbody-VERSION-*.whl                  the Python package (scripts/wheel.sh --zig), also for aarch64, where it is not tested
#   flexbody-VERSION.cdx.json               bill of materials (CycloneDX); -python: that of the wheel
#   SHA256SUMS
#
# Needed: what the build needs (README.md), the Rust target x86_64-unknown-linux-musl (rustup adds it) and a C compiler for musl
# (musl-tools of Debian and Ubuntu, musl-gcc of Fedora, or MUSL_CC=compiler), dpkg, python3 with venv and pip, and docker, podman or
# buildah. Every file is tested where nothing else is: in an empty folder as the file system (root, or user namespaces), in an image, in an
# empty virtual environment. FLEXBODY=program is an ordinary build of the same
# sources to compare with, which is then not built. CONTRIBUTING.md says what else belongs to a release: that ./.ci/run passes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=scripts/cmake.sh
source scripts/cmake.sh

wheel=yes
if [ "${1:-}" = --no-wheel ]; then
    wheel=no
    shift
fi
out="${1:-target/release-files}"
target=x86_64-unknown-linux-musl
# Instructions of a function that is inlined (225 without a word), and bytes that the program may have.
INLINED=40
MOST=19000000
version="$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -1)"
built="${CARGO_TARGET_DIR:-target}"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

fail() {
    echo "error: $1" >&2
    echo "  help: $2" >&2
    exit 1
}

step() { echo "== $1"; }

# Copies a model of the fixtures into the folder $1.
copy_model() {
    mkdir -p "$1"
    cp fixtures/models/connecting_rod/{model.toml,K.mtx.gz,M.mtx.gz,nodes.csv,dofs.csv,mesh.inp} "$1"
}

# Runs a program with the folder $1 as its whole file system and without an environment: `in_root ROOT PROGRAM ARGUMENTS`. Users other than
# root need user namespaces.
in_root() {
    local change=("$(command -v chroot || echo /usr/sbin/chroot)")
    [ "$(id -u)" = 0 ] || change=("$(command -v unshare)" --map-root-user "${change[@]}")
    env -i "${change[@]}" "$@"
}

# Converts, checks and exports a model with the program $2 of the file system $1.
converts_in_root() {
    copy_model "$1/work"
    in_root "$1" "$2" convert /work/model.toml --modes 6 --quiet -o /work/body.flex.h5 --report /work/body.html
    in_root "$1" "$2" check /work/body.flex.h5 --quiet
    in_root "$1" "$2" export /work/body.flex.h5 --to sid --quiet -o /work/body.SID_FEM
    rm -r "$1/work"
}

step "what is needed"
compiler="${MUSL_CC:-$(command -v x86_64-linux-musl-gcc || command -v musl-gcc || true)}"
[ -n "$compiler" ] || fail "no C compiler for musl: HDF5, METIS and mimalloc are C" "apt-get install musl-tools, or MUSL_CC=compiler"
for tool in readelf sha256sum python3 dpkg dpkg-deb; do
    command -v "$tool" >/dev/null || fail "$tool is not there" "install it (binutils, coreutils, python3, dpkg)"
done
builder=""
for tool in docker podman buildah; do
    # A client of docker without its server builds nothing.
    if [ -z "$builder" ] && "$tool" info >/dev/null 2>&1; then builder="$tool"; fi
done
[ -n "$builder" ] || fail "there is no builder of container images" "install buildah, podman, or docker with its server"
if [ ! -d "$(rustc --print sysroot)/lib/rustlib/$target" ]; then
    command -v rustup >/dev/null || fail "the Rust target $target is not installed" "install it as the rest of Rust was installed"
    rustup target add "$target"
fi

step "each optional part alone"
for part in cluster embedded-c import response; do
    cargo check --package flexbody --lib --bins --locked --no-default-features --features "cli,bundled-hdf5,$part"
done

step "build"
[ -n "${FLEXBODY:-}" ] || cargo build --release --locked --package flexbody
# The two usual compilers are found without being told.
[ -z "${MUSL_CC:-}" ] || export CC_x86_64_unknown_linux_musl="$MUSL_CC"
# Size: nothing unwinds, and there are no tables for it; only small functions are inlined (conversions and simulations take 4 % longer, and the program
# is 1.5 MB smaller); no relocations; equal functions once, by the linker that Rust brings along.
linkers="$(rustc --print sysroot)/lib/rustlib/$(rustc -vV | sed -n 's/^host: //p')/bin/gcc-ld"
[ -x "$linkers/ld.lld" ] || fail "this Rust brings no linker along ($linkers)" "take Rust from rustup"
flags="-C force-unwind-tables=no -C llvm-args=-inline-threshold=$INLINED -C relocation-model=static"
flags="$flags -C link-arg=-fuse-ld=lld -C link-arg=-B$linkers -C link-arg=-Wl,--icf=all -C link-arg=-Wl,-T,$PWD/scripts/static.ld"
CFLAGS_x86_64_unknown_linux_musl="-fno-asynchronous-unwind-tables -fno-unwind-tables" CARGO_TARGET_X86_64_UNKNOWN_LINUX_MUSL_RUSTFLAGS="$flags" \
    cargo build --profile dist --locked --package flexbody --target "$target"
ordinary="$(realpath "${FLEXBODY:-$built/release/flexbody}")"
static="$(realpath "$built/$target/dist/flexbody")"

step "the program stands alone"
if readelf --dynamic --wide "$static" | grep NEEDED || readelf --program-headers --wide "$static" | grep INTERP; then
    fail "$static needs the libraries above" "build all C code for musl: look for a compiler that is not $compiler"
fi
# ldd knows such files too; it exits with 1 for some of them.
(ldd "$static" 2>&1 || true) | sed 's/^/   ldd: /'
"$static" --version
size="$(stat -c %s "$static")"
echo "   $size bytes"
[ "$size" -lt "$MOST" ] || fail "$static has more than $MOST bytes" "look for what has grown (cargo bloat), or take a lower INLINED"
env -i "$static" doctor | sed 's/^/   /'
# Without anything from outside: no environment, and no file but its own and those of a model.
mkdir "$work/empty"
cp "$static" "$work/empty/flexbody"
converts_in_root "$work/empty" /flexbody

step "it ends as it should: signals, a panic, results that cannot be printed"
FLEXBODY="$static" cargo test --locked --package flexbody --test program -- --include-ignored ends::

step "its results are those of the ordinary build"
for model in connecting_rod bracket_hex20 frame_beams; do
    for program in ordinary static; do
        "${!program}" convert "fixtures/models/$model/model.toml" --modes 20 --quiet -o "$work/$model.$program.flex.h5"
    done
    # The digits that are promised.
    "$static" compare "$work/$model.ordinary.flex.h5" "$work/$model.static.flex.h5" --quiet >/dev/null
    "$static" check "$work/$model.ordinary.flex.h5" --quiet >/dev/null
    "$ordinary" check "$work/$model.static.flex.h5" --quiet >/dev/null
    if cmp --silent "$work/$model.ordinary.flex.h5" "$work/$model.static.flex.h5"; then
        echo "   $model: the same bytes"
    else
        # METIS takes rand() of the C library: evidence/pages/promises.md.
        echo "   $model: the same body, not to the last bit"
    fi
done

step "licences and bill of materials"
mkdir -p "$out"
rm -f "$out"/flexbody[-_]* "$out/SHA256SUMS"
name="flexbody-$version-x86_64-linux"
mkdir "$work/$name"
python3 scripts/sbom.py --target "$target" --sbom "$out/flexbody-$version.cdx.json" --licences "$work/$name/LICENCES-OF-DEPENDENCIES.txt"

step "archive"
cp "$static" README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE CITATION.cff packaging/Dockerfile "$work/$name"
mkdir -p "$work/$name/completions" "$work/$name/man"
for shell in bash zsh fish; do
    "$static" completions "$shell" >"$work/$name/completions/flexbody.$shell"
done
"$static" man >"$work/$name/man/flexbody.1"
commands="$("$static" --help | sed -n '/^Commands:/,/^Options:/s/^  \([a-z]\{1,\}\) .*/\1/p' | grep -v '^help$')"
[ "$(wc -w <<<"$commands")" -gt 20 ] || fail "the help of the program lists only: $commands" "look at how scripts/release.sh reads it"
for command in $commands; do
    "$static" man "$command" >"$work/$name/man/flexbody-$command.1"
done
# Equal files give an equal archive.
export SOURCE_DATE_EPOCH="${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || echo 0)}"
tar --create --directory "$work" --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner "$name" | gzip -n9 >"$out/$name.tar.gz"
mkdir "$work/unpacked"
tar --extract --file "$out/$name.tar.gz" --directory "$work/unpacked" --strip-components=1
converts_in_root "$work/unpacked" /flexbody

step "container image"
copy_model "$work/model"
command=(convert model.toml --modes 6 --quiet -o body.flex.h5)
if [ "$builder" = buildah ]; then
    images=(buildah --storage-driver vfs --root "$work/images" --runroot "$work/images-state")
    "${images[@]}" bud --isolation chroot --quiet --tag flexbody "$work/$name" >/dev/null
    container="$("${images[@]}" from flexbody)"
    "${images[@]}" run --isolation chroot --volume "$work/model:/work" "$container" /usr/bin/flexbody "${command[@]}"
    "${images[@]}" rm --all >/dev/null
else
    image="$("$builder" build --quiet "$work/$name")"
    "$builder" run --rm --user "$(id -u):$(id -g)" --volume "$work/model:/work" "$image" "${command[@]}"
    "$builder" image rm "$image" >/dev/null
fi
"$ordinary" check "$work/model/body.flex.h5" --quiet
echo "   built and run by $builder"

step "Debian package"
packaging/debian.sh "$version" "$work/$name" "$out"
debian="$work/debian"
mkdir -p "$debian"/var/lib/dpkg/{info,updates,triggers}
touch "$debian"/var/lib/dpkg/{status,available}
packages=(dpkg --root="$debian" --log=/dev/null --force-not-root --force-bad-path)
[ "$(id -u)" = 0 ] || packages=(fakeroot "${packages[@]}")
"${packages[@]}" --install "$out/flexbody_${version}_amd64.deb" >/dev/null
converts_in_root "$debian" /usr/bin/flexbody
"${packages[@]}" --purge flexbody >/dev/null 2>&1
left="$(find "$debian" -path "$debian/var" -prune -o -type f -print)"
[ -z "$left" ] || fail "the removed package leaves $left" "look into packaging/debian.sh"
if command -v lintian >/dev/null; then
    # Who publishes it is the maintainer: DEBFULLNAME, DEBEMAIL.
    lintian --fail-on error --suppress-tags bogus-mail-host,bogus-mail-host-in-debian-changelog,root-in-contact "$out/flexbody_${version}_amd64.deb" 2>/dev/null
fi
echo "   installed into an empty root, run there, and removed"

step "conda package"
python3 -m venv "$work/tools"
"$work/tools/bin/pip" install --quiet --disable-pip-version-check 'py-rattler-build>=0.73,<0.74' 'auditwheel>=6,<7'
"$work/tools/bin/python" packaging/conda/build.py "$version" "$work/$name" "$out"

if [ "$wheel" = yes ]; then
    step "wheel"
    FLEXBODY_WHEELS="$(realpath "$out")" ./scripts/wheel.sh --zig
    glibc="$("$work/tools/bin/auditwheel" show "$out"/flexbody-*-cp310-abi3-*.whl | tr '\n' ' ' | sed -n 's/.*following platform tag: *"manylinux_2_\([0-9]*\)_x86_64".*/\1/p')"
    [ "${glibc:-99}" -le 17 ] || fail "auditwheel finds that the wheel needs glibc 2.${glibc:-?}" "look for what scripts/wheel.sh --zig has not built by zig"
    echo "   for glibc 2.$glibc and newer"
    python3 scripts/sbom.py --manifest python/Cargo.toml --target x86_64-unknown-linux-gnu --sbom "$out/flexbody-$version-python.cdx.json"

    step "wheel of aarch64, built here and not tested"
    other=aarch64-unknown-linux-gnu
    if [ -d "$(rustc --print sysroot)/lib/rustlib/$other" ] || { command -v rustup >/dev/null && rustup target add "$other"; }; then
        FLEXBODY_WHEELS="$(realpath "$out")" ./scripts/wheel.sh --zig --target "$other"
    else
        echo "   left out: the Rust target $other is not installed"
    fi
fi

step "sums"
(cd "$out" && sha256sum flexbody[-_]* | tee SHA256SUMS)
if [ -n "$(git status --porcelain 2>/dev/null)" ]; then
    echo "warning: the sources are not those of a commit" >&2
fi
