"""Opens the report of `wake detect PRODUCT` in a headless Chromium, uses it, and takes a picture of it.

    python3 tests/foreign/view_report.py wakes/report.html SCREENSHOT.png      # needs `chromium` (apt-get install chromium)

The page gets a script that filters, hovers over a wake, zooms, drags and clicks on a row, and notes what it sees.
"""
import json
import re
import subprocess
import sys
import tempfile
from html import unescape
from pathlib import Path

PROBE = """<script>{
const seen = {}, visible = () => [...document.querySelectorAll("#rows tr")].filter((row) => row.style.display !== "none").length;
const choose = (sure, least) => {
  byId("sure").checked = sure; byId("sure").dispatchEvent(new Event("change"));
  byId("least").value = least; byId("least").dispatchEvent(new Event("input"));
  return visible();
};
seen.all = choose(false, 0); seen.likely = choose(false, 0.5); seen.sure = choose(true, 0);
const line = document.querySelector("line.wake"), before = map.getAttribute("viewBox");
line.dispatchEvent(new MouseEvent("mouseenter")); line.dispatchEvent(new MouseEvent("mousemove", { clientX: 100, clientY: 100 }));
seen.tip = tip.textContent; seen.shown = tip.style.display; seen.marked = document.querySelectorAll(".on").length;
const box = () => map.getAttribute("viewBox").split(" ").map(Number);
view.dispatchEvent(new WheelEvent("wheel", { deltaY: -1, clientX: 300, clientY: 300, cancelable: true }));
seen.zoomed = box()[2] / Number(before.split(" ")[2]);
document.querySelector("#rows tr").click(); seen.clicked = box();
const note = document.createElement("pre"); note.id = "seen"; note.textContent = JSON.stringify(seen); document.body.append(note);
}</script></body>"""

report, picture = Path(sys.argv[1]), Path(sys.argv[2])
page = report.read_text()
# Names of XML and HTML are no addresses that are fetched.
addresses = [url for url in re.findall(r"https?://[^\s\"'<>]+", page) if "www.w3.org" not in url]
assert not addresses, f"the page asks the network: {addresses[:3]}"
wakes = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S).group(1))["wakes"]


def chromium(page, *options):
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=4000", *options, page.resolve().as_uri()]
    return subprocess.run(["chromium", *options], check=True, capture_output=True, text=True, timeout=300).stdout


with tempfile.TemporaryDirectory() as folder:
    probed = Path(folder) / "report.html"
    probed.write_text(page.replace("</body>", PROBE))
    told = chromium(probed, "--dump-dom")
seen = json.loads(unescape(re.search(r'<pre id="seen">(.*?)</pre>', told, re.S).group(1)))
chance = [wake["score"] if wake["probability"] is None else wake["probability"] for wake in wakes]
expected = {"all": len(wakes), "likely": sum(p >= 0.5 for p in chance), "sure": sum(wake["sure"] for wake in wakes)}
assert {key: seen[key] for key in expected} == expected, (seen, expected)
assert seen["tip"].startswith("wake 1,") and seen["shown"] == "block" and seen["marked"] >= 2, seen
assert abs(seen["zoomed"] - 0.8) < 1e-6, seen
centre = [0.5 * (wakes[0]["from"][k] + wakes[0]["to"][k]) for k in range(2)]
assert all(abs(seen["clicked"][k] + 0.5 * seen["clicked"][2 + k] - centre[k]) < 1e-3 for k in range(2)), (seen, centre)
chromium(report, "--window-size=1400,900", f"--screenshot={picture.resolve()}")
print(f"{report}: {expected['sure']} sure of {len(wakes)} wakes; filter, hover, zoom and click work; {picture}")
