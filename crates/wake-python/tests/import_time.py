"""Fails where `import shipwake` takes longer than so many seconds, the best of three new processes.

    python tests/import_time.py 0.3
"""

import subprocess
import sys

CODE = "import time; begin = time.perf_counter(); import shipwake; print(time.perf_counter() - begin)"

allowed = float(sys.argv[1])
best = min(float(subprocess.check_output([sys.executable, "-c", CODE])) for _ in range(3))
print(f"import shipwake: {best:.2f} s of {allowed} s")
sys.exit(best > allowed)
