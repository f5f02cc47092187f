"""Runs a check on a tree with planted faults; passes when the check exits 1 and prints exactly EXPECTED.

Usage: expect_findings.py EXPECTED CHECK ARGUMENT...
"""

import subprocess
import sys
from pathlib import Path

expected = Path(sys.argv[1]).read_text(encoding="utf-8").splitlines()
result = subprocess.run([sys.executable, *sys.argv[2:]], capture_output=True, text=True, check=False)
found = result.stdout.splitlines()
for line in expected:
    if line not in found:
        print("not caught:", line)
for line in found:
    if line not in expected:
        print("not planted:", line)
print(result.stderr, end="")
sys.exit(0 if found == expected and result.returncode == 1 else 1)
