"""Exit codes for every kind of mistake, what goes to stdout and what to stderr, resume and overwrite."""

import json
import os
import pty
import subprocess
import time
import unittest

from harness import ProgramTest, sheet


class CommandLine(ProgramTest):
    def setUp(self):
        super().setUp()
        self.write_clip("clip.h5", *sheet())
        self.write_job("a", "clip.h5")

    def test_help(self):
        self.assertIn("Examples", self.run_program("--help").stdout)
        self.assertIn("components", self.run_program("--help-job").stdout)
        self.assertRegex(self.run_program("--version").stdout, r"^batchenc \d+\.\d+")
        for command in ("decode", "info", "verify", "segment", "import", "export", "synth"):
            self.assertIn("xample", self.run_program(command, "--help").stdout)

    def test_mistakes_on_the_command_line_are_2(self):
        self.run_program("a.yaml")
        for arguments in ([], ["--no-such-option"], ["a.yaml", "--threads", "0"], ["a.yaml", "--threads", "two"],
                          ["a.yaml", "--threads", "1025"], ["a.yaml", "--memory", "lots"], ["a.yaml", "--memory", "1"],
                          ["a.yaml", "--progress", "loud"], ["a.yaml", "--log-level", "all"],
                          ["a.yaml", "--overwrite", "--resume"], ["decode", "out/a.h5"], ["decode"], ["info"],
                          ["verify", "out/a.h5"], ["synth"], ["synth", "flag"],
                          ["synth", "dragon", "-o", "x.h5"], ["synth", "flag", "-o", "x.h5", "--vertices", "3"],
                          ["synth", "flag", "-o", "x.h5", "--frames", "0"],
                          ["--overwrite", "decode", "out/a.h5", "-o", "x.h5"],
                          ["--dry-run", "info", "out/a.h5"], ["a.yaml", "info", "out/a.h5"],
                          *(["decode", "out/a.h5", "-o", "x.h5", "--frames", span]
                            for span in ("5", "7:3", "3:3", "a:b", "-1:3", "1:2:3", "99999999999999999999:")),
                          ["decode", "out/a.h5", "-o", "x.h5", "--components", "0"]):
            with self.subTest(arguments):
                self.assertEqual(self.run_program(*arguments, expect=2).stdout, "")
                self.assertFalse((self.folder / "x.h5").exists())

    def test_mistakes_in_job_files_are_2_and_nothing_is_run(self):
        self.write_job("same", "clip.h5", output="out/a.h5")
        self.write_job("over", "clip.h5", output="clip.h5")
        self.write_job("wrong", "clip.h5", more="colour: red\n")
        for bad in ("missing.yaml", "same.yaml", "over.yaml", "wrong.yaml"):
            with self.subTest(bad):
                done = self.run_program("a.yaml", bad, "--overwrite", expect=2)
                self.assertIn(bad, done.stderr)
                self.assertEqual(self.files(), [])
        self.assertIn("wrong.yaml:7:", self.run_program("wrong.yaml", expect=2).stderr)

    def test_a_failed_job_is_1_and_the_others_are_done(self):
        self.write_job("b", "missing.h5")
        self.write_job("c", "clip.h5")
        done = self.run_program("a.yaml", "b.yaml", "c.yaml", expect=1)
        self.assertEqual(self.files(), ["a.h5", "c.h5"])
        self.assertIn("missing.h5", done.stderr)
        self.assertNotIn("missing.h5", done.stdout)

    def test_failures_of_commands_are_1(self):
        (self.folder / "junk.h5").write_bytes(b"nothing of the kind" * 100)
        self.run_program("a.yaml")
        self.write_clip("other.h5", sheet()[0] + 1.0, sheet()[1])
        for arguments in (["decode", "missing.h5", "-o", "x.h5"], ["decode", "junk.h5", "-o", "x.h5"],
                          ["decode", "clip.h5", "-o", "x.h5"], ["decode", "out/a.h5", "-o", "x.h5", "--frames", "0:99"],
                          ["decode", "out/a.h5", "-o", "clip.h5"], ["decode", "out/a.h5", "-o", "out/a.h5", "--overwrite"],
                          ["info", "missing.h5"], ["info", "junk.h5"], ["info", "clip.h5"],
                          ["verify", "out/a.h5", "--source", "other.h5"], ["verify", "out/a.h5", "--source", "missing.h5"],
                          ["verify", "clip.h5", "--source", "clip.h5"], ["synth", "flag", "-o", "clip.h5"],
                          ["synth", "flag", "-o", "junk.h5/x.h5"]):
            with self.subTest(arguments):
                self.run_program(*arguments, expect=1)
                self.assertFalse((self.folder / "x.h5").exists())

    def test_existing_outputs(self):
        self.run_program("a.yaml")
        first = (self.folder / "out/a.h5").stat().st_mtime_ns
        self.assertIn("--overwrite", self.run_program("a.yaml", expect=1).stderr)
        self.run_program("a.yaml", "--resume")
        self.assertEqual((self.folder / "out/a.h5").stat().st_mtime_ns, first)
        self.run_program("a.yaml", "--overwrite")
        second = (self.folder / "out/a.h5").stat().st_mtime_ns
        self.assertNotEqual(second, first)
        self.write_job("a", "clip.h5", components=3)
        self.run_program("a.yaml", "--resume")
        self.assertNotEqual((self.folder / "out/a.h5").stat().st_mtime_ns, second)
        self.assertEqual(self.info("out/a.h5")["clips"][0]["parameters"]["components"], 3)
        self.run_program("decode", "out/a.h5", "-o", "x.h5")
        self.run_program("decode", "out/a.h5", "-o", "x.h5", expect=1)
        self.run_program("decode", "out/a.h5", "-o", "x.h5", "--overwrite")
        self.run_program("synth", "flag", "-o", "x.h5", "--overwrite", "--vertices", 100, "--frames", 3)

    def test_dry_run_writes_nothing(self):
        done = self.run_program("a.yaml", "--dry-run")
        self.assertIn("196 vertices", done.stdout)
        self.assertIn("out/a.h5", done.stdout)
        self.write_job("b", "missing.h5")
        self.run_program("a.yaml", "b.yaml", "--dry-run", expect=1)
        self.assertEqual(self.files("."), ["a.yaml", "b.yaml", "clip.h5"])

    def test_progress_lines_off_a_terminal(self):
        done = self.run_program("a.yaml")
        lines = [line for line in done.stderr.splitlines() if line.startswith("PROGRESS")]
        self.assertEqual(lines[-1], "PROGRESS: 100%")
        percents = [int(line.removeprefix("PROGRESS: ").removesuffix("%")) for line in lines]
        self.assertEqual(percents, sorted(set(percents)))
        self.assertNotIn("PROGRESS", done.stdout)
        self.assertIn("out/a.h5", done.stdout)
        self.assertNotIn("PROGRESS", self.run_program("a.yaml", "--overwrite", "--progress", "none").stderr)
        self.assertIn("PROGRESS: 100%", self.run_program("a.yaml", "--resume").stderr)

    def test_bar_on_a_terminal(self):
        try:
            master, slave = pty.openpty()
        except OSError as error:  # a chroot without devpts
            self.skipTest(f"no terminal to be had: {error}")
        self.addCleanup(os.close, master)
        subprocess.run(self.command("a.yaml"), cwd=self.folder, stderr=slave, stdout=subprocess.DEVNULL, check=True)
        os.close(slave)
        shown = os.read(master, 100000).decode()
        self.assertIn("####] 100%", shown)
        self.assertNotIn("PROGRESS", shown)

    def test_json_log(self):
        self.write_job("b", "missing.h5")
        done = self.run_program("a.yaml", "b.yaml", "--log-json", expect=1)
        events = [json.loads(line) for line in done.stderr.splitlines()]
        for event in events:
            self.assertLessEqual({"time", "level", "message"}, event.keys())
        jobs = {event["job"]: event for event in events if event.get("event") == "job"}
        self.assertEqual(jobs["a"]["status"], "done")
        self.assertGreater(jobs["a"]["metrics"]["bpvf"], 0)
        self.assertEqual(jobs["b"]["error"]["name"], "io")
        self.assertEqual([event["percent"] for event in events if event.get("event") == "progress"][-1], 100)
        self.assertEqual(sum(event.get("event") == "blas" for event in events), 1)

    def test_info(self):
        self.write_job("a", "clip.h5", more="clips: {length: 8}\n")
        self.run_program("a.yaml")
        info = self.info("out/a.h5")
        self.assertEqual((info["vertex_count"], info["triangle_count"], info["frame_count"]), (196, 338, 20))
        self.assertEqual(info["method"], "rlpca")
        self.assertEqual([clip["first_frame"] for clip in info["clips"]], [0, 8, 16])
        for clip in info["clips"]:
            self.assertEqual(sum(clip["section_bytes"].values()), clip["bytes"])
        coded = info["connectivity_bytes"] + sum(clip["bytes"] for clip in info["clips"])
        self.assertEqual(info["metrics"]["bits_total"], 8 * coded)
        self.assertIn("bpvf", self.run_program("info", "out/a.h5").stdout)
        self.write_clip("frame.h5", *sheet(frames=1))
        self.write_job("frame", "frame.h5")
        self.run_program("frame.yaml")
        self.assertIsNone(self.info("out/frame.h5")["metrics"]["da"])  # undefined: nothing moves in one frame

    def test_a_full_stdout_is_a_failure(self):
        self.run_program("a.yaml")
        with open("/dev/full", "w") as full:
            done = subprocess.run(self.command("info", "out/a.h5"), cwd=self.folder, stdout=full,
                                  stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 1, done.stderr)

    def most_threads(self, *arguments):
        """Runs the program; the largest number of threads that it was seen to have."""
        # OpenBLAS starts threads of its own when it is loaded, before main can forbid it; they do no work.
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
        process = subprocess.Popen(self.command(*arguments), cwd=self.folder, env=environment,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        most = 0
        while process.poll() is None:
            try:
                most = max(most, len(os.listdir(f"/proc/{process.pid}/task")))
            except FileNotFoundError:
                break
            time.sleep(0.001)
        self.assertEqual(process.wait(), 0)
        return most

    def test_one_thread_is_one_thread(self):
        self.run_program("synth", "jelly", "-o", "jelly.h5", "--vertices", 5000, "--frames", 400)
        self.write_job("jelly", "jelly.h5", clusters=20, components=20, more="clips: {length: 20}\n")
        self.assertEqual(self.most_threads("jelly.yaml", "--threads", 1), 1)
        self.assertEqual(self.most_threads("jelly.yaml", "--overwrite", "--threads", 2), 2)


if __name__ == "__main__":
    unittest.main()
