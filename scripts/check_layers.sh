#!/usr/bin/env bash
# Refuses includes that look up: every folder may include only what the table below allows.
#   scripts/check_layers.sh [ROOT]    ROOT: another checkout to examine (default: this one)
# Prints each forbidden include as file:line, and ends with 1 when there is one.
set -euo pipefail
root=${1:-$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)}
cd "$root"

l0="base math sampling"
l1="$l0 particles image"
l2="$l1 geometry media materials lights camera"

# folder | what it may include besides itself; scene/flat: those files of scene/ whose names begin so
table="
base         |
math         | base
sampling     | base math
particles    | $l0
image        | $l0
geometry     | $l1
media        | $l1 geometry
materials    | $l1
lights       | $l1 geometry
camera       | $l1
integrators  | $l2
scene        | $l2
io           | $l1 scene geometry/triangle_mesh geometry/splat_hierarchy
meshing      | $l2
backend/cpu  | $l2 integrators scene/flat
backend/cuda | $l2 integrators scene/flat
render       | $l2 integrators scene io meshing backend/cpu backend/cuda face
measure      | $l2 integrators scene io meshing backend/cpu render face
reproduction | $l2 integrators scene io measure render face
face         | face
apps         | face
python       | face
web          | face
"
# The triangle mesh is plain data: meshing, which cannot see scene, makes it, and io reads and writes it. So are the arrays
# of a hierarchy of splats, which a file holds as they are.
# 'face' is include/embrun, whose headers see only each other and the standard library.

# Libraries that only some folders may see.
private_libraries="
embree3 | backend/cpu
openvdb | io meshing
pugixml.hpp | io
"

folders=()
for folder in src include/embrun apps python web; do
  if [ -d "$folder" ]; then folders+=("$folder"); fi
done

find "${folders[@]}" -type f \
     \( -name '*.h' -o -name '*.cpp' -o -name '*.cu' -o -name '*.cuh' -o -name '*.inl' \) | sort |
xargs -r -d '\n' awk -v table="$table" -v libraries="$private_libraries" '
  function trim(s) { gsub(/^[ \t]+|[ \t]+$/, "", s); return s }
  function read_table(text, into,    lines, n, i, cells, words, m, k) {
    n = split(text, lines, "\n")
    for (i = 1; i <= n; i++) {
      if (split(lines[i], cells, "|") < 2) continue
      into[trim(cells[1])] = 1
      m = split(trim(cells[2]), words, /[ \t]+/)
      for (k = 1; k <= m; k++) if (words[k] != "") into[trim(cells[1]), words[k]] = 1
    }
  }
  # The folder of the table in which a path lies, or "" when it is none of ours.
  function room_of(path,    parts) {
    split(path, parts, "/")
    if (parts[1] == "embrun") return "face"
    if (parts[1] == "backend") return parts[1] "/" parts[2]
    return (parts[1] in allowed) ? parts[1] : ""
  }
  function exists(path,    line, found) {
    found = (getline line < path) >= 0
    if (found) close(path)
    return found
  }
  function refuse(why) {
    printf "%s:%d: %s: %s\n", FILENAME, FNR, why, trim($0)
    refused = 1
  }
  BEGIN { read_table(table, allowed); read_table(libraries, library) }
  FNR == 1 {
    own = FILENAME
    directory = FILENAME
    sub(/[^\/]*$/, "", directory)
    sub(/^(src|include)\//, "", own)
    from = room_of(own)
    files++
  }
  /^[ \t]*#[ \t]*include[ \t]*[<"]/ {
    if (from == "") { refuse("this folder is not in the table of scripts/check_layers.sh"); next }
    quoted = ($0 ~ /include[ \t]*"/)
    path = $0
    sub(/^[^<"]*[<"]/, "", path)
    sub(/[>"].*$/, "", path)
    if (path ~ /(^|\/)\.\.\//) { refuse("include by a path from src/, not by .."); next }

    split(path, parts, "/")
    if (parts[1] in library && !((parts[1], from) in library)) { refuse(from " may not see " parts[1]); next }
    if (!quoted && parts[1] != "embrun") {
      if (from == "face" && (path ~ /\// || path ~ /\.h$/)) refuse("the public face needs the standard library alone")
      next
    }
    to = room_of(path)
    if (to == "") {
      # An application may keep headers of its own beside it, or name them from its top folder.
      split(FILENAME, place, "/")
      outer = from == "apps" || from == "python" || from == "web"
      if (!(outer && (exists(directory path) || exists(place[1] "/" path))))
        refuse("includes begin with a folder of src/")
      next
    }
    if (to == from || (from, to) in allowed) next
    for (edge in allowed) {  # a part of a folder: scene/flat allows scene/flat_scene.h
      split(edge, pair, SUBSEP)
      if (pair[1] == from && pair[2] ~ /\// && index(path, pair[2]) == 1) next
    }
    refuse(from " may not include " to)
  }
  END {
    if (refused) exit 1
    printf "layers: %d files, no include looks up\n", files
  }'
