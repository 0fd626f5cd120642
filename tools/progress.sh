# What tools/setup, tools/run, tools/test and tools/package show of long commands; they read it with `source`.

# Shows each line "[N/M] TEXT" of the input as "N of M: TEXT": in a terminal as one line that changes, elsewhere one every ten
# seconds. Other lines are printed as they are. When the input is silent for ten seconds, the last one comes again with its age.
show_progress() {
  local line part='' count='' text='' since=0 shown=-10 status columns
  columns=$( (stty size </dev/tty) 2>/dev/null | cut -d' ' -f2) || true
  while :; do
    status=0
    IFS= read -r -t 10 line || status=$?
    part+=${line%$'\r'}
    if [ $status -gt 128 ]; then   # silence, perhaps in the middle of a line
      [ -z "$text" ] || show_line "$count, $((SECONDS - since)) s: $text"
      continue
    fi
    if [[ $part =~ ^\[([1-9][0-9]*)/([0-9]+)\]\ (.*) ]]; then
      count="${BASH_REMATCH[1]} of ${BASH_REMATCH[2]}" text=${BASH_REMATCH[3]} since=$SECONDS
      if [ -t 1 ] || [ $((SECONDS - shown)) -ge 10 ]; then
        show_line "$count: $text"
        shown=$SECONDS
      fi
    elif [[ -n $part && ! $part =~ ^(\[0/|ninja:\ no\ work) ]]; then   # [0/: looking for files that came or went
      [ ! -t 1 ] || printf '\r\033[K'
      printf '%s\n' "$part"
    fi
    part=
    [ $status -eq 0 ] || break
  done
  [ ! -t 1 ] || printf '\r\033[K'
}

show_line() {
  if [ -t 1 ]; then printf '\r\033[K  %s' "${1:0:$((${columns:-80} - 3))}"; else printf '  %s\n' "$1"; fi
}

# build PRESET: configures and builds it.
build() {
  mkdir -p build
  cmake --preset "$1" >build/"$1".log 2>&1 || { cat build/"$1".log >&2; return 1; }
  cmake --build --preset "$1" | show_progress
}
