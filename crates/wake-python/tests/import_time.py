"""Fails where `import shipwake` takes more than so many seconds of a processor, the least of three new processes: what else the machine does
makes the clock's time longer, which is printed, too.

    python tests/import_time.py 0.3
"""

import subprocess
import sys

CODE = """
import time
begin = time.process_time(), time.perf_counter()
import shipwake
print(time.process_time() - begin[0], time.perf_counter() - begin[1])
"""

allowed = float(sys.argv[1])
times = [subprocess.check_output([sys.executable, "-c", CODE], text=True).split() for _ in range(3)]
processor, clock = (min(map(float, of)) for of in zip(*times, strict=True))
print(f"import shipwake: {processor:.2f} s of {allowed} s, {clock:.2f} s by the clock")
sys.exit(processor > allowed)
