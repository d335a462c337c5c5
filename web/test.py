#!/usr/bin/env python3
"""Opens the page in a browser without a window, at the width of a desktop and of a phone: test.py PAGE RAYS FOLDER
RAYS is what python/tests/twenty.c printed; FOLDER receives screenshots."""
import base64, json, os, pathlib, re, subprocess, sys, tempfile, time

page, expected_rays, folder = (pathlib.Path(path).resolve() for path in sys.argv[1:])
folder.mkdir(parents=True, exist_ok=True)
# (name, width, height, is a phone)
SCREENS = [("desktop", 1280, 1000, False), ("phone", 390, 844, True)]
PATIENCE = 60  # seconds that any one thing may take on a busy machine
failed = []


class Browser:
    """Chromium by its protocol over pipes, which needs no package."""

    def __init__(self, profile):
        ours_in, theirs_out = os.pipe()
        theirs_in, ours_out = os.pipe()

        def pipes():
            # The browser reads from 3 and writes to 4; copies beyond them are safe from one another.
            reads, writes = os.dup(theirs_in), os.dup(theirs_out)
            os.dup2(reads, 3)
            os.dup2(writes, 4)

        self.process = subprocess.Popen(
            ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe", f"--user-data-dir={profile}"],
            preexec_fn=pipes, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(theirs_in)
        os.close(theirs_out)
        self.input, self.output = os.fdopen(ours_in, "rb"), ours_out
        self.number, self.session, self.errors, self.pending = 0, None, [], b""

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self.output, data):]
        while True:
            answer = self.read()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def read(self):
        while b"\0" not in self.pending:
            data = self.input.read1(1 << 20)
            if not data:
                raise RuntimeError("the browser ended")
            self.pending += data
        line, _, self.pending = self.pending.partition(b"\0")
        answer = json.loads(line)
        event, parameters = answer.get("method"), answer.get("params", {})
        is_error = event == "Runtime.exceptionThrown" or parameters.get("type") == "error" or parameters.get("entry", {}).get("level") == "error"
        if event in ("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded") and is_error:
            self.errors.append(json.dumps(parameters)[:400])
        if event == "Network.requestWillBeSent" and parameters["request"]["url"].startswith("http"):
            self.errors.append("a request to " + parameters["request"]["url"])
        return answer

    def open(self, url, width, height, phone):
        self.session = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network", "DOM"):
            self.call(f"{domain}.enable")
        scale = 2 if phone else 1
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=phone)
        self.call("Emulation.setTouchEmulationEnabled", enabled=phone)
        self.call("Page.navigate", url=url)

    def value(self, script):
        answer = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(json.dumps(answer["exceptionDetails"])[:400])
        return answer["result"].get("value")

    def until(self, script):
        end = time.monotonic() + PATIENCE
        while not (value := self.value(script)):
            if time.monotonic() > end:
                raise RuntimeError(f"waited in vain for {script}")
            time.sleep(0.1)
        return value

    def drag(self, phone):
        """By a finger or by the mouse, over the left picture."""
        x, y = self.value("(r => [r.x + r.width / 4, r.y + r.height / 2])(document.getElementById('mis').getBoundingClientRect())")
        for step, (touch, mouse) in enumerate([("Start", "Pressed"), ("Move", "Moved"), ("Move", "Moved"), ("Move", "Moved"), ("End", "Released")]):
            at = {"x": x + 15 * min(step, 3), "y": y}
            if phone:
                self.call("Input.dispatchTouchEvent", type="touch" + touch, touchPoints=[] if touch == "End" else [at])
            else:
                self.call("Input.dispatchMouseEvent", type="mouse" + mouse, button="left", buttons=1, clickCount=1, **at)

    def screenshot(self, path):
        size = self.call("Page.getLayoutMetrics")["cssContentSize"]
        picture = self.call("Page.captureScreenshot", captureBeyondViewport=True, clip={**size, "x": 0, "y": 0, "scale": 1})
        path.write_bytes(base64.b64decode(picture["data"]))


def expect(holds, what):
    print(("ok    " if holds else "FAIL  ") + what)
    if not holds:
        failed.append(what)


def small_map():
    """A Radiance file of 16 x 8 texels, plain: grey, and a lamp."""
    texels = [bytes([200, 180, 150, 134] if (x, y) == (11, 2) else [60, 70, 80, 127]) for y in range(8) for x in range(16)]
    file = folder / "small.hdr"
    file.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n" + b"".join(texels))
    return file


# How a picture's bytes are told apart, and both errors of both pictures.
PICTURE = "document.getElementById('mis').toDataURL() + document.getElementById('wis').toDataURL()"
ERRORS = "['mis', 'wis'].flatMap(n => ['relative', 'absolute'].map(m => Number(document.getElementById(`${n}-${m}`).textContent)))"
KNOWN = f"{ERRORS}.every(x => x > 0)"

# How far the references are: at a quarter the pictures are done, on machines as slow as may be.
REFERENCE = "Number(document.documentElement.dataset.reference)"


def set_input(name, value):
    return f"(e => {{ e.value = {value}; e.dispatchEvent(new Event('input')); }})(document.getElementById('{name}'))"


def visit(browser, name, width, height, phone):
    browser.open(f"file://{page}", width, height, phone)
    browser.until("document.documentElement?.dataset.reference !== undefined")
    browser.value(set_input("seconds", 2))
    browser.until(KNOWN)
    early = browser.value(ERRORS)
    browser.until(f"{REFERENCE} > 0.25 && {REFERENCE} < 1")
    late = browser.value(ERRORS)
    expect(all(b < a for a, b in zip(early, late)), f"{name}: errors fall: {early} to {late}")
    expect(browser.value("document.documentElement.scrollWidth") <= width, f"{name}: nothing is wider than the window")
    before = browser.value(PICTURE)
    browser.screenshot(folder / f"{name}.png")
    browser.drag(phone)
    browser.until(f"({PICTURE}).length > 0 && document.getElementById('turn').value !== '0'")
    browser.until(KNOWN)
    turned = browser.value(PICTURE)
    expect(turned != before, f"{name}: a drag turns the light")
    browser.value("document.querySelector('input[value=\"1\"]').click()")
    browser.value(set_input("roughness", 0.2))
    browser.until(f"document.getElementById('roughness-value').textContent === '0.2' && {KNOWN}")
    expect(browser.value(PICTURE) != turned, f"{name}: another material shows")
    node = browser.call("DOM.querySelector", nodeId=browser.call("DOM.getDocument")["root"]["nodeId"], selector="#file")["nodeId"]
    browser.call("DOM.setFileInputFiles", nodeId=node, files=[str(small_map())])
    browser.until("document.getElementById('status').textContent.startsWith('small.hdr: 16')")
    expect(True, f"{name}: a map from a file")


# Twenty rays, and the means of 48 x 36 pixels by MIS and by wis under a grey map with a lamp: noise is about 0.3 %.
MODULE = """(async () => {
    const bytes = Uint8Array.from(atob("WASM"), c => c.charCodeAt(0));
    const wasm = (await WebAssembly.instantiate(bytes)).instance.exports;
    // A call may move the memory: it comes before the memory is looked at.
    const floats = (at, count) => new Float32Array(wasm.memory.buffer, at, count);
    const rays = floats(wasm.twenty_rays(), 80), words = Array.from(new Uint32Array(rays.buffer, rays.byteOffset, 80));
    const tracer = wasm.tracer_new(64, 32);
    floats(wasm.tracer_texels(tracer), 3 * 64 * 32).fill(0.5).fill(90, 3 * (64 * 8 + 40), 3 * (64 * 8 + 42));
    wasm.tracer_build(tracer, 0);
    wasm.tracer_turn(tracer, 0.5, 0.1);
    wasm.tracer_material(tracer, 1, 0.5);
    wasm.tracer_effort(tracer, 2, 0, 3);
    wasm.tracer_begin(tracer, 48, 36, 0, 1);
    const means = [0, 1].map(k => floats(wasm.tracer_render(tracer, k, 64), 3 * 48 * 36).reduce((a, b) => a + b));
    return [words, means];
})()"""


def module(browser):
    words, [mis, wis] = browser.value(MODULE.replace("WASM", re.search(r'^start\("([^"]*)"', page.read_text(), flags=re.M)[1]))
    expected = [int(word, 16) for word in expected_rays.read_text().split()[:80]]
    expect(len(expected) == 80 and words == expected, "bits of twenty rays are those of the C library")
    expect(abs(wis / mis - 1) < 0.02, f"means of MIS and wis agree within 2 %: {wis / mis:.4f}")


with tempfile.TemporaryDirectory() as profile:
    browser = Browser(profile)
    try:
        for screen in SCREENS:
            visit(browser, *screen)
        module(browser)
        expect(not browser.errors, f"no console errors and no requests {browser.errors or ''}")
    finally:
        browser.process.terminate()
        browser.process.wait()
print(f"{len(failed)} failed")
sys.exit(bool(failed))
