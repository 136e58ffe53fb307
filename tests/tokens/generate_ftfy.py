"""Writes ftfy.json: prompts and what ftfy makes of them, in lower case.

pip install ftfy==6.3.1; python generate_ftfy.py > ftfy.json

Prompts in which ftfy guesses an encoding are left out (Tokenizer::encode does not guess).
"""

import json
import random

import ftfy

PIECES = [
    "ship", "wake ", " ", " SAR", "10 mps", ".", ", ", "'s", "\n", "\t", " 32 ", "degrees", "!?", "-",
    "&amp;", "&lt;", "&quot;", "&#39;", "&#x27;", "&deg;", "&nbsp;", "&eacute;", "&amp;amp;", "&nosuch;", "&", "&;",
    "&Omega;", "&hellip;", "&#8217;", "&amp;#176;", "<", ">",
    "\x00", "\x07", "\x0b", "\x1b", "\x1b[31m", "\x1b[0;1m", "\x1b[", "\x7f", "\ufeff", "\ufff9", "\u206a",
    "\u2018", "\u2019", "\u201c", "\u201d", "\u02bc", "\u2013", "\u2026",
    "\ufb01", "\ufb04", "\u0133", "\u01c6", "\u0149",
    "\uff33\uff21\uff32", "\uff11", "\uff76\uff9e", "\uffe5", "\u3000", "\uff5e",
    "e\u0301", "A\u030a", "\u00e9", "\u212b", "\u1100\u1161\u11a8", "\u09c7\u09be", "o\u0323\u0302",
    "\u039f\u0394\u039f\u03a3", "\u0130", "\u1e9e", "\u0416", "\u6d77", "\u200b", "\u200d", "\U0001f6a2",
    "\x92", "\x93", "\x85", "\u2028", "\u00a0", "\u00b0",
]


def guesses_encoding(prompt):
    steps = ftfy.fix_and_explain(prompt).explanation or []
    return any(step.action == "decode" and step.parameter != "windows-1252" for step in steps) or any(
        step.parameter in ("restore_byte_a0", "decode_inconsistent_utf8") for step in steps
    )


random.seed(20261121)
cases = [[piece, ftfy.fix_text(piece).lower()] for piece in PIECES]
while len(cases) < 400:
    prompt = "".join(random.choices(PIECES, k=random.randint(2, 12)))
    if not any(guesses_encoding(line) for line in prompt.split("\n")):
        cases.append([prompt, ftfy.fix_text(prompt).lower()])
print("[\n" + ",\n".join(json.dumps(case) for case in cases) + "\n]")
