#!/usr/bin/env bash
# An engineer of machine learning: a labelled data set in two shards, joined, and ten steps of training on it.
. "$(dirname "$0")/common.sh"
clone
program
for shard in 0 1; do
  "$wake" dataset --count 24 --shard "$shard/2" --out "$scratch/set"
done
"$wake" dataset --merge --out "$scratch/set"
made "$scratch"/set/{metadata.jsonl,coco.json,data.yaml,dataset.json,images/000023.png,labels/000023.txt}
"$wake" train wake-model prior --data "$scratch/set" --steps 10 --batch 4 --out "$scratch/model"
made "$scratch"/model/{config.json,prior.safetensors,mean.jsonl}
echo "ml_engineer: a data set and ten steps"
