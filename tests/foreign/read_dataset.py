"""Reads a folder of `wake dataset` with the libraries that it is made for; with a card and shards also those, as from a hub.

    pip install datasets pillow pycocotools webdataset
    wake dataset --card --webdataset out/shards
    python tests/foreign/read_dataset.py out/dataset [out/shards]
"""

import json
import os
import pathlib
import sys

os.environ["HF_HUB_OFFLINE"] = "1"

from datasets import load_dataset
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

folder = pathlib.Path(sys.argv[1])
lines = [json.loads(line) for line in (folder / "metadata.jsonl").open()]
grid = json.loads((folder / "dataset.json").read_text())["recipe"]["scene"]["grid"]



def told(value):
    """Without the keys that other rows have and this one has not: a table fills them with None."""
    if isinstance(value, dict):
        return {key: told(part) for key, part in value.items() if part is not None}
    return value


data = load_dataset("imagefolder", data_dir=str(folder))["train"]
assert len(data) == len(lines), (len(data), len(lines))
for row, line in zip(data, lines):
    assert row["text"] == line["text"]
    assert row["image"].size == (grid["columns"], grid["rows"]), row["image"].size
    assert row["image"].mode == "L"
    for key in line.keys() - {"file_name", "objects"}:
        assert told(row[key]) == told(line[key]), (key, row[key], line[key])
    assert row["objects"]["bbox"] == line["objects"]["bbox"]
print(len(data), "rows:", ", ".join(data.column_names))

coco = COCO(str(folder / "coco.json"))
boxes = [box for line in lines for box in line["objects"]["bbox"]]
assert len(coco.imgs) == len(lines) and len(coco.anns) == len(boxes)
for image in coco.imgs.values():
    assert (folder / image["file_name"]).is_file()

# The labels as detections must score 1.
perfect = [dict(annotation, score=1.0) for annotation in coco.anns.values()]
evaluation = COCOeval(coco, coco.loadRes(perfect), "bbox")
evaluation.evaluate()
evaluation.accumulate()
evaluation.summarize()
assert evaluation.stats[0] > 0.9999, evaluation.stats

# The YOLO boxes are the same boxes.
for index, line in enumerate(lines):
    name = pathlib.Path(line["file_name"]).with_suffix(".txt").name
    found = [[float(v) for v in text.split()] for text in (folder / "labels" / name).open()]
    assert len(found) == len(line["objects"]["bbox"])
    for (kind, x, y, w, h), box, category in zip(found, line["objects"]["bbox"], line["objects"]["categories"]):
        assert kind == category
        corner = [(x - w / 2) * grid["columns"], (y - h / 2) * grid["rows"]]
        size = [w * grid["columns"], h * grid["rows"]]
        assert all(abs(a - b) < 1e-3 for a, b in zip(corner + size, box)), (index, found, box)
print("COCO and YOLO agree:", len(boxes), "boxes")

# So are the oriented ones: YOLO's, moved to the edge where they lie outside, and DOTA's.
for line in lines:
    name = pathlib.Path(line["file_name"]).with_suffix(".txt").name
    yolo = [[float(v) for v in text.split()] for text in (folder / "labels-obb" / name).open()]
    dota = [text.split() for text in (folder / "labelTxt" / name).open()]
    oriented = line["objects"]["oriented"]
    assert len(yolo) == len(dota) == len(oriented)
    for shares, pixels, corners, category in zip(yolo, dota, oriented, line["objects"]["categories"]):
        assert shares[0] == category and pixels[8] == ["wake", "ship"][category]
        flat = [v for corner in corners for v in corner]
        assert all(abs(float(a) - b) < 1e-2 for a, b in zip(pixels, flat))
        for k, value in enumerate(flat):
            size = grid[["columns", "rows"][k % 2]]
            assert abs(shares[1 + k] * size - min(max(value, 0), size)) < 1e-3
print("YOLO-OBB and DOTA agree")

# Every image is in one of the two lists that data.yaml names.
lists = [(folder / name).read_text().split() for name in ("trainset.txt", "valset.txt")]
assert sorted(lists[0] + lists[1]) == ["./" + line["file_name"] for line in lines]
print(len(lists[0]), "images to train,", len(lists[1]), "to validate")

# A card names the columns: the folder is read as it would be from a hub, with the types of the card.
if (folder / "README.md").exists():
    carded = load_dataset(str(folder))["train"]
    assert set(data.column_names) <= set(carded.column_names), (data.column_names, carded.column_names)
    assert [row["text"] for row in carded] == [line["text"] for line in lines]
    assert [row["seed"] for row in carded] == [line["seed"] for line in lines]
    print("the card fits:", carded.features["objects"])

# The shards hold the same rows, in their splits.
if len(sys.argv) > 2:
    import webdataset

    shards = sorted(pathlib.Path(sys.argv[2]).glob("*.tar"))
    splits = load_dataset(sys.argv[2])
    for split, name in (("train", "trainset.txt"), ("validation", "valset.txt")):
        listed = (folder / name).read_text().split()
        expected = {line["file_name"]: line for line in lines if "./" + line["file_name"] in listed}
        rows = list(splits[split]) if expected else []
        assert {row["json"]["file_name"] for row in rows} == expected.keys(), split
        for row in rows:
            line = expected[row["json"]["file_name"]]
            assert row["txt"] == line["text"] and row["json"]["objects"] == line["objects"]
            assert row["png"].size == (grid["columns"], grid["rows"])
        paths = [str(path) for path in shards if path.name.startswith(split)]
        samples = list(webdataset.WebDataset(paths, shardshuffle=False)) if paths else []
        assert [json.loads(sample["json"])["file_name"] for sample in samples] == list(expected)
        for sample in samples:
            name = json.loads(sample["json"])["file_name"]
            assert sample["png"] == (folder / name).read_bytes()
            assert sample["txt"].decode() == expected[name]["text"]
    print(len(shards), "shards hold the set")
