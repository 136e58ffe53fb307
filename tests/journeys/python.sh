#!/usr/bin/env bash
# A Python user: from a clone to the first labelled wake in a new virtual environment, as in a notebook's cell. Says how long it took, the build
# included; a CARGO_TARGET_DIR that is set shortens it. PYTHON names the interpreter, 3.10 or newer.
. "$(dirname "$0")/common.sh"
clone
begin=$SECONDS
"${PYTHON:-python3}" -m venv "$scratch/venv"
"$scratch/venv/bin/pip" install --quiet --disable-pip-version-check ./crates/wake-python
cd "$scratch"
venv/bin/python - <<'END'
import shipwake

wake = shipwake.simulate(shipwake.Scene(ship={"speed": 8}, sea={"wind_speed": 3}))
wake.write_png("wake.png")
[thing] = wake.labels.objects
print(f"a {thing.name} at {thing.box.round()}, {thing.length:.0f} pixels long, of {thing.contrast_db:.1f} dB")
END
made "$scratch/wake.png"
echo "python: a labelled wake $((SECONDS - begin)) s after the clone"
