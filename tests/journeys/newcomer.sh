#!/usr/bin/env bash
# A newcomer: from a clone to a wake with its labels drawn, without the diffusion model. Says how long it took, the build
# included; a CARGO_TARGET_DIR that is set shortens it.
. "$(dirname "$0")/common.sh"
clone
begin=$SECONDS
cargo run --release -p wake-cli --no-default-features --features simulate -- simulate \
  --overlay --set sea.wind_speed=3 --out "$scratch/out"
made "$scratch"/out/{image.png,overlay.png,fields.safetensors,labels.json,report.json}
echo "newcomer: a labelled wake $((SECONDS - begin)) s after the clone"
