#!/bin/bash
# Makes the README's pictures anew, from the current code: records the main job's squares, pictures it as the viewer opens it, and
# keeps the left half. Takes Python with venv, and a Vulkan driver (Debian: mesa-vulkan-drivers libvulkan1 libxkbcommon-x11-0 libegl1).
#
#   recordings/pictures.sh
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
viewer=0.36.3 # as the rerun crate in Cargo.toml
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q "rerun-sdk==$viewer" pillow
cargo build --release --manifest-path "$here/../Cargo.toml"
# The methods that a recording shows.
"$here/../target/release/treadmark" --method umbmark,maximum_likelihood --out "$work/experiment" > /dev/null 2>&1
RERUN_ANALYTICS=0 "$work/venv/bin/rerun" --headless --window-size 1920x1080 --screenshot-to "$work/shot.png" "$work/experiment/recording.rrd"
"$work/venv/bin/python" - "$work/shot.png" "$here/experiment.png" << 'PYTHON'
import sys
from PIL import Image

shot = Image.open(sys.argv[1]).convert("RGB")
width, height = shot.size
# Without the viewer's own bars, and without the right half, whose words a page has as words.
left = shot.crop((0, round(0.025 * height), round(0.545 * width), round(0.973 * height)))
left = left.resize((1100, round(1100 * left.height / left.width)), Image.LANCZOS)
left.quantize(128, dither=Image.Dither.NONE).save(sys.argv[2], optimize=True)
PYTHON
echo "recordings/experiment.png is new; look at it before it is committed"
