# A Debian 12 that holds nothing but its minimal packages, in a folder; bare_root and bare_clone read this with `source`.
# The caller sets `root`, where the system comes to lie. It is removed when the caller ends.
part() { printf '%4d s  %s\n' $SECONDS "$1"; }
fails() { echo "$(basename "$0"): $1" >&2; exit 1; }
clean() {
  umount "$root/proc" 2>/dev/null || true
  rm -rf --one-file-system "$root"
}
inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }

need_root() {
  [ "$(id -u)" -eq 0 ] && return
  echo "This test needs root, because it changes into another system's root folder: start it with sudo." >&2
  exit 77
}

# bare_system PROGRAM: makes it. PROGRAM: the program whose file /proc would name, where no /proc can be mounted.
bare_system() {
  trap clean EXIT
  clean
  local file sources=()   # where this system gets its packages, if it is a Debian 12
  if grep -q '^VERSION_CODENAME=bookworm' /etc/os-release; then
    for file in /etc/apt/sources.list /etc/apt/sources.list.d/debian.sources; do
      [ ! -s $file ] || sources+=($file)
    done
  fi
  mmdebstrap --quiet --mode=root --variant=minbase --dpkgopt=force-unsafe-io bookworm "$root" "${sources[@]}"
  # Where a file system cannot be mounted, the program still finds its folder.
  mount -t proc proc "$root/proc" 2>/dev/null || { mkdir -p "$root/proc/self" && ln -s "$1" "$root/proc/self/exe"; }
  [ -s "$root/etc/resolv.conf" ] || cp /etc/resolv.conf "$root/etc/"
  inside apt-get update -qq
}
