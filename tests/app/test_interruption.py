"""Whatever ends the program, the place of a result holds the old one, the new one, or nothing."""

import random
import shutil
import signal
import subprocess
import time
import unittest

from harness import ProgramTest

KILLS = 25


class Interruption(ProgramTest):
    def test_signals_stop_cleanly(self):
        self.run_program("synth", "flag", "-o", "flag.h5", "--vertices", 20000, "--frames", 200)
        jobs = [self.write_job(name, "flag.h5", clusters=20, components=20, more="clips: {length: 20}\n")
                for name in "abc"]
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(number), subprocess.Popen(
                    self.command(*jobs, "--overwrite"), cwd=self.folder, stderr=subprocess.PIPE,
                    stdout=subprocess.DEVNULL, text=True) as program:
                for line in program.stderr:
                    if line.startswith("PROGRESS: 5"):  # 5 % or the fifties, whichever is first
                        break
                program.send_signal(number)
                sent = time.monotonic()
                rest = program.stderr.read()
                self.assertEqual(program.wait(60), 130, rest)
                self.assertLess(time.monotonic() - sent, 10)
                self.assertNotIn("PROGRESS: 100%", rest)
                finished = self.files()
                self.assertLessEqual(set(finished), {"a.h5", "b.h5"})  # no c, no .tmp
                for name in finished:
                    self.run_program("info", f"out/{name}")

    def test_decode_and_synth_stop_cleanly(self):
        # Both take seconds after their first progress, however late this process hears of it.
        self.run_program("synth", "flag", "-o", "flag.h5", "--vertices", 20000, "--frames", 400)
        (self.folder / "a.yaml").write_text("batchenc: 1\nname: a\ninput: {file: flag.h5}\noutput: out/a.h5\n"
                                            "clips: {length: 20}\n"
                                            "codec: {method: splitcoder, predictor: local-multiway}\n")
        self.run_program("a.yaml")
        for arguments in (["decode", "out/a.h5", "-o", "back.h5"],
                          ["synth", "jelly", "-o", "back.h5", "--vertices", 100000, "--frames", 4000]):
            with self.subTest(arguments[0]), subprocess.Popen(
                    self.command(*arguments), cwd=self.folder, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
                    text=True) as program:
                program.stderr.readline()  # its first progress
                program.send_signal(signal.SIGINT)
                self.assertEqual(program.wait(60), 130, program.stderr.read())
                self.assertEqual(self.files("."), ["a.yaml", "flag.h5", "out"])

    def test_kill_leaves_the_old_result_or_the_new_one(self):
        self.run_program("synth", "walker", "-o", "walker.h5", "--vertices", 400, "--frames", 60)
        self.write_job("old", "walker.h5", output="out/x.h5", components=3)
        new = self.write_job("new", "walker.h5", output="out/x.h5", components=6, more="clips: {length: 4}\n")
        self.run_program("old.yaml")
        shutil.copy(self.folder / "out/x.h5", self.folder / "old.h5")
        start = time.monotonic()
        self.run_program(new, "--overwrite")
        whole_run = time.monotonic() - start

        chance = random.Random(20)
        killed, found = 0, {3: 0, 6: 0}
        for _ in range(KILLS):
            shutil.copy(self.folder / "old.h5", self.folder / "out/x.h5")
            program = subprocess.Popen(self.command(new, "--overwrite"), cwd=self.folder,
                                       stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            time.sleep(chance.uniform(0.1, 1.1) * whole_run)
            program.kill()
            killed += program.wait() == -signal.SIGKILL
            result = self.info("out/x.h5")  # opens and passes its digest, or this fails
            found[result["clips"][0]["parameters"]["components"]] += 1
        self.assertGreaterEqual(killed, KILLS // 2, "the kills came too late to mean anything")
        self.assertGreater(found[3], 0, found)

        # What the kills left beside is no result, and is in nobody's way.
        self.assertEqual([name for name in self.files() if name.endswith(".h5")], ["x.h5"])
        (self.folder / "out/x.h5").unlink()
        self.assertNotIn("kept", self.run_program(new, "--resume").stderr)
        self.run_program(new, "--overwrite")
        self.run_program("verify", "out/x.h5", "--source", "walker.h5")


if __name__ == "__main__":
    unittest.main()
