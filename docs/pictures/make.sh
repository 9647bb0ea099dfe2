#!/usr/bin/env bash
# Makes the pictures of the documentation, from generated worlds and ring.obj. Takes about a minute after the build.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
cargo build --release --package hither-cli
hither() { "${CARGO_TARGET_DIR:-target}/release/hither" "$@"; }
sky=232,238,245
office='world:office?n=33'

hither render "$office" --camera open --size 960x540 --background $sky -o docs/pictures/office.png
hither render "$office" --camera open --size 480x270 --shade ids --background $sky -o docs/pictures/ids.png
hither render "$office" --camera open --size 480x270 --shade depth --background $sky -o docs/pictures/depth.png
hither render "$office" --camera open --size 480x270 --shade complexity -o docs/pictures/work-hzb.png
hither render "$office" --camera open --size 480x270 --shade complexity --algorithm zbuffer \
  -o docs/pictures/work-zbuffer.png
hither lines 'world:office?n=1' --camera corridor --faces flat --size 960x540 -o docs/pictures/office-lines.svg
hither render world:hills --camera valley --size 960x540 --background $sky -o docs/pictures/hills.png

# Maps of what occluder planes hide, in the manner of figures 10 and 11 of Coorg & Teller 1996.
map() { hither cull "world:$1" --method planes --fov 75 --eye "$2" --target "$3" --map "docs/pictures/map-$1.svg"; }
map soda 14.25,1.7,16.25 104,1.7,21
map city -280,1.7,-440 100,1.7,200
map tetra -6,1.7,-84 14,1.7,96

# Figure 2c of Snyder & Lengyel 1997: needs Graphviz.
above='--eye 0,5,0 --up 0,0,1'
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
hither render docs/pictures/ring.obj $above --size 240x240 --shade ids --background $sky -o docs/pictures/ring.png
hither order docs/pictures/ring.obj $above --dot "$work/ring.dot"
dot -Tsvg "$work/ring.dot" -o docs/pictures/ring.svg
hither layers 'world:toothpicks?n=60' -o "$work/layers" --size 320x180 --samples 3 \
  --focus 4.4 --f-number 1 --focal-length 300 --lens-samples 21
cp "$work"/layers/focus{,-single,-truth}.png docs/pictures/

# Layers side by side, front to back, and the composite: needs ImageMagick.
hither layers 'world:toothpicks?n=7' -o "$work/apart" --size 360x270 --samples 3 \
  --eye 1.4,1.5,3.6 --target 0,-0.1,0 --fov 42 --leave-out-empty
montage "$work"/apart/[0-9]*.png "$work/apart/composite.png" -background "rgb($sky)" -bordercolor "rgb($sky)" -border 1 \
  -geometry 96x72+1+1 -background white -tile 10x -depth 8 -strip docs/pictures/apart.png
