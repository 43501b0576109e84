#!/usr/bin/env python3
"""The page of `foresound view` in a headless Chromium: it draws, sources and doors can be dragged, and a minute with keys held
down grows neither the page nor the program.

Usage: view_page.py FORESOUND CHROMIUM PICTURE.png [--seconds N] [--leak]; --leak keeps every state in the page, and must fail.
"""

import argparse
import base64
import json
import os
import subprocess
import sys
import tempfile
import time

# Until so many steps are made the keys are held, longer than asked for where the machine is busy. A leak of one state a step
# is 10 kB and more: 4.5 MB in the three quarters that are compared.
LEAST_STEPS = 600
MAX_HEAP_GROWTH_BYTES = 2 << 20
MAX_PROGRAM_GROWTH_BYTES = 4 << 20
# Elements and listeners of the page, which a step neither adds nor removes.
MAX_MORE_NODES = 100
PATIENCE_S = 90


class Browser:
    """Chromium by its debugging protocol, through two pipes."""

    def __init__(self, program, folder):
        to_browser, own_out = os.pipe()
        own_in, from_browser = os.pipe()
        words = [program, "--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--enable-unsafe-swiftshader",
                 "--disable-dev-shm-usage", "--disable-background-networking", "--no-first-run", f"--user-data-dir={folder}",
                 "--window-size=1280,800", "--js-flags=--expose-gc", "about:blank"]
        # The protocol is read from descriptor 3 and written to 4. Ours may be these: they are moved out of the way.
        ends = [os.dup2(end, number, inheritable=True) for end, number in ((to_browser, 60), (from_browser, 61))]
        shell = ["bash", "-c", 'exec 3<&60 4>&61 60<&- 61>&-; exec "$@"', "bash", *words]
        self.process = subprocess.Popen(shell, pass_fds=ends, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for end in (to_browser, from_browser, *ends):
            os.close(end)
        self.out, self.answers = own_out, os.fdopen(own_in, "rb")
        self.session, self.number, self.events, self.rest = None, 0, [], b""

    def send(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.read()
            if answer.get("id") == self.number:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]
            self.events.append(answer)

    def read(self):
        while b"\0" not in self.rest:
            piece = self.answers.raw.read(1 << 16)
            assert piece, "Chromium has ended"
            self.rest += piece
        message, _, self.rest = self.rest.partition(b"\0")
        return json.loads(message)

    def open(self, url):
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log", "HeapProfiler"):
            self.send(domain + ".enable")
        self.send("Page.navigate", url=url)

    def value(self, expression):
        result = self.send("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait(self, expression):
        began = time.monotonic()
        while not self.value(expression):
            assert time.monotonic() - began < PATIENCE_S, f"still not: {expression}"
            time.sleep(0.1)

    def key(self, kind, key):
        code = ord(key.upper())
        self.send("Input.dispatchKeyEvent", type=kind, key=key, code="Key" + key.upper(), windowsVirtualKeyCode=code)

    def drag(self, start, end):
        for kind, (x, y) in (("mousePressed", start), ("mouseMoved", end), ("mouseReleased", end)):
            self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def problems(self):
        """Exceptions, errors of the console, and requests that leave the program."""
        found = []
        for event in self.events:
            method, what = event.get("method"), event.get("params", {})
            if method == "Runtime.exceptionThrown" or (method == "Log.entryAdded" and what["entry"]["level"] == "error"):
                found.append(json.dumps(what)[:400])
            if method == "Network.requestWillBeSent":
                url = what["request"]["url"]
                if not url.startswith(("http://127.0.0.1:", "data:", "blob:", "about:")):
                    found.append("asks for " + url)
        return found


def resident_bytes(pid):
    with open(f"/proc/{pid}/status") as status:
        line = next(line for line in status if line.startswith("VmRSS:"))
    return int(line.split()[1]) << 10


def measure(browser, pid):
    for _ in range(2):
        browser.send("HeapProfiler.collectGarbage")
    counted = browser.send("Memory.getDOMCounters")
    return {
        "heap": browser.send("Runtime.getHeapUsage")["usedSize"],
        "nodes": counted["nodes"] + counted["jsEventListeners"],
        "program": resident_bytes(pid),
    }


def check_picture(browser, file):
    """Saves a picture of the page, and looks at it: walls and lines over the background, not one colour."""
    data = browser.send("Page.captureScreenshot", format="png")["data"]
    with open(file, "wb") as out:
        out.write(base64.b64decode(data))
    colours, drawn = browser.value("""(async (text) => {
      const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
      const board = new OffscreenCanvas(image.width, image.height).getContext("2d");
      board.drawImage(image, 0, 0);
      // The middle, without the panels.
      const [w, h] = [image.width / 2, image.height / 2];
      const data = new Uint32Array(board.getImageData(w / 2, h / 2, w, h).data.buffer);
      const counts = new Map();
      for (const pixel of data) counts.set(pixel, (counts.get(pixel) || 0) + 1);
      return [counts.size, 1 - Math.max(...counts.values()) / data.length];
    })(%s)""" % json.dumps(data))
    assert colours > 50 and drawn > 0.1, f"{colours} colours, {drawn:.2f} of the picture is more than its background"
    return f"{colours} colours"


def check_dragging(browser):
    pixel = browser.value("pixel_of(camera_now().matrix, state.sources[0])")
    before = browser.value("state.sources[0]")
    browser.drag(pixel, [pixel[0] + 60, pixel[1] + 30])
    browser.wait(f"Math.hypot(...add(state.sources[0], {json.dumps(before)}, -1)) > 0.2")
    pixel = browser.value("pixel_of(camera_now().matrix, add(door_end(state.doors[0]), [0, 1, 0]))")
    before = browser.value("state.doors[0].angle")
    browser.drag(pixel, [pixel[0] + 60, pixel[1] + 30])
    browser.wait(f"Math.abs(state.doors[0].angle - {before}) > 0.05")


def hold_keys(browser, pid, seconds):
    """A minute of walking in circles; what has grown from a quarter of it on."""
    start, samples = time.monotonic(), []
    places, first = set(), browser.value("steps")
    share = 0
    while share < 1:
        assert time.monotonic() - start < seconds + 10 * PATIENCE_S, "the page makes no steps"
        made = browser.value("steps") - first
        share = min((time.monotonic() - start) / seconds, made / LEAST_STEPS)
        # As a keyboard repeats.
        for key in "we":
            browser.key("keyDown", key)
        time.sleep(0.03)
        if share > (1 + 0.5 * len(samples)) / 4:
            samples.append(measure(browser, pid))
            places.add(tuple(browser.value("state.listener")))
    for key in "we":
        browser.key("keyUp", key)
    samples.append(measure(browser, pid))
    assert len(places) > 3, "the listener stands still"
    for sample in samples:
        print("  ", sample)
    return {name: samples[-1][name] - samples[0][name] for name in samples[0]}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("foresound")
    parser.add_argument("chromium")
    parser.add_argument("picture")
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--leak", action="store_true")
    wanted = parser.parse_args()
    words = [wanted.foresound, "view", "doorway", "--sources", "4", "--door", "8.1,0,3.07", "--port", "0", "--json"]
    program = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    browser = None
    try:
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            browser = Browser(wanted.chromium, folder)
            browser.open(json.loads(program.stdout.readline())["url"])
            browser.wait("typeof state !== 'undefined' && state && state.paths.length > 10 && mesh.count > 0")
            keep = "kept.push(JSON.parse(JSON.stringify(state)));" if wanted.leak else ""
            browser.value("""steps = 0; kept = [];
                show_figures = ((own) => () => { steps += 1; %s own(); })(show_figures); 0""" % keep)
            time.sleep(3)
            picture = check_picture(browser, wanted.picture)
            check_dragging(browser)
            grown = hold_keys(browser, program.pid, wanted.seconds)
            assert browser.value("""spectrogram.getImageData(0, 0, 420, 140).data
                .filter((value, at) => at % 4 < 3 && value > 40).length > 100"""), "the spectrogram is black"
            assert not browser.problems(), browser.problems()
            bounds = {"heap": MAX_HEAP_GROWTH_BYTES, "nodes": MAX_MORE_NODES, "program": MAX_PROGRAM_GROWTH_BYTES}
            for name, bound in bounds.items():
                assert grown[name] < bound, f"{name} grew by {grown[name]}, more than {bound}"
            print(f"the page draws {picture}, drags, and grows in {wanted.seconds:.0f} s with keys held by {grown}")
    except AssertionError as problem:
        print("FAIL", problem)
        return 1
    finally:
        program.terminate()
        program.wait()
        if browser:
            browser.process.terminate()
            browser.process.wait()
    return 0


sys.exit(main())
