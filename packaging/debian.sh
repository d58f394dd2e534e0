#!/usr/bin/env bash
# Builds the Debian package of the static program: `debian.sh VERSION FOLDER OUT`. FOLDER is the unpacked archive of the program, OUT gets
# the package. It depends on nothing, so that it suits every Debian and Ubuntu of this processor. DEBFULLNAME and DEBEMAIL name the maintainer.
set -euo pipefail
version="$1" archive="$2" out="$3"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
root="$work/root"
maintainer="${DEBFULLNAME:-flexbody developers} <${DEBEMAIL:-root@localhost}>"
share="$root/usr/share"

install -D -m 755 "$archive/flexbody" "$root/usr/bin/flexbody"
install -d "$share/man/man1" "$share/doc/flexbody" "$root/DEBIAN"
cp "$archive"/man/*.1 "$share/man/man1"
gzip -n9 "$share"/man/man1/*.1
install -D -m 644 "$archive/completions/flexbody.bash" "$share/bash-completion/completions/flexbody"
install -D -m 644 "$archive/completions/flexbody.zsh" "$share/zsh/vendor-completions/_flexbody"
install -D -m 644 "$archive/completions/flexbody.fish" "$share/fish/vendor_completions.d/flexbody.fish"
install -m 644 "$archive"/{README.md,CHANGELOG.md,CITATION.cff} "$share/doc/flexbody"
gzip -n9 <"$archive/LICENCES-OF-DEPENDENCIES.txt" >"$share/doc/flexbody/LICENCES-OF-DEPENDENCIES.txt.gz"
gzip -n9 >"$share/doc/flexbody/changelog.gz" <<EOF
flexbody ($version) unstable; urgency=medium

  * Changes are in CHANGELOG.md.

 -- $maintainer  $(LC_ALL=C date --utc --rfc-email --date "@${SOURCE_DATE_EPOCH:-0}")
EOF
{
    printf 'flexbody is licensed by MIT or Apache-2.0, at the choice of the user. On Debian systems the Apache-2.0 licence is\n'
    printf 'in /usr/share/common-licenses/Apache-2.0. The MIT licence:\n\n'
    cat "$archive/LICENSE-MIT"
    printf '\nThe licences of the libraries that the program contains are in LICENCES-OF-DEPENDENCIES.txt.gz, beside this file.\n'
} >"$share/doc/flexbody/copyright"
install -D -m 644 /dev/stdin "$share/lintian/overrides/flexbody" <<'EOF'
# The program is built against no library of the distribution: it runs on all of them.
flexbody: statically-linked-binary [usr/bin/flexbody]
flexbody: embedded-library *
EOF
cat >"$root/DEBIAN/control" <<EOF
Package: flexbody
Version: $version
Architecture: amd64
Maintainer: $maintainer
Section: science
Priority: optional
Installed-Size: $(du -sk --apparent-size "$root/usr" | cut -f1)
Description: exact flexible bodies for multibody simulation
 Turns the mass and stiffness matrices of a finite element model into an exact
 flexible body for multibody simulation: the lowest modes, proved complete, and
 the constants of the equations of motion in a floating frame of reference, in
 one HDF5 file and in the formats of other programs.
EOF
(cd "$root" && find usr -type f -print0 | sort -z | xargs -0 md5sum) >"$root/DEBIAN/md5sums"
find "$root" -type d -exec chmod 755 {} +
chmod 644 "$root/DEBIAN"/*
dpkg-deb --root-owner-group -Zxz --build "$root" "$out/flexbody_${version}_amd64.deb" >/dev/null
