# What the journeys share: a scratch folder, and a copy of the tree as a clone has it. Sourced, not run.
set -euo pipefail
tree=$(cd "$(dirname "$0")/../.." && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# How the program is built; CARGO_FLAGS="--workspace --features ndarray,train" takes what the tests have built.
read -ra flags <<<"${CARGO_FLAGS:---release}"

# The tracked files of the tree, in $scratch/clone.
clone() {
  mkdir "$scratch/clone"
  git -C "$tree" ls-files -z | tar -C "$tree" --null -T - -c | tar -x -C "$scratch/clone"
  cd "$scratch/clone"
}

# Fails, naming the file, where one is missing or empty.
made() {
  for file in "$@"; do
    [ -s "$file" ] || { echo "no $file" >&2; exit 1; }
  done
}

# Builds the program, and sets `wake` to where it is.
program() {
  cargo build --quiet "${flags[@]}" --package wake-cli
  case " ${flags[*]} " in *" --release "*) profile=release ;; *) profile=debug ;; esac
  wake=${CARGO_TARGET_DIR:-$PWD/target}/$profile/wake
}
