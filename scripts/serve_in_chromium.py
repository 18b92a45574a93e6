"""Drives the page of `eixo serve` in headless Chromium as a person does: a wrong file, a log that is dropped, its columns confirmed by
keyboard, the diagnosis run, the report opened; then two logs at a time, one of them stopped.

    .venv/bin/python scripts/serve_in_chromium.py [--eixo PATH] [--log FILE] [--pictures FOLDER]

Without a log it makes one. With --pictures it leaves the page at 1280 and 390 pixels, in the light and in the dark. Where Chromium is
missing it says so and ends well.
"""

import argparse
import asyncio
import base64
import json
import math
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

CHROMIUM = ("chromium", "chromium-browser", "google-chrome", "chrome")
SWITCHES = (
    "--headless=new --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --remote-debugging-port=0"
)


def servo(path, rows):
    """A servo's log: 2e-3 kg.m2, viscous and Coulomb friction under three tones, 0.5 N.m/A, an encoder of 16 bits."""
    lines = ["t (ms);Iq_meas (A);Pos_act (deg)"]
    step = math.tau / 65536
    for k in range(rows):
        t = 1e-3 * k
        x = v = a = 0.0
        for amplitude, w in ((0.5, 3), (0.1, 11), (0.03, 37)):
            s, c = math.sin(w * t), math.cos(w * t)
            x, v, a = x + amplitude * s, v + amplitude * w * c, a - amplitude * w * w * s
        torque = 2e-3 * a + 1e-2 * v + math.copysign(5e-3, v)
        lines.append(f"{k};{torque / 0.5:.6f};{math.degrees(round(x / step) * step):.5f}")
    path.write_text("\n".join(lines).replace(".", ",") + "\n")


class Tab:
    """A tab of the browser, by the DevTools protocol."""

    def __init__(self, socket):
        self.socket, self.count, self.errors = socket, 0, []

    async def call(self, method, **parameters):
        self.count += 1
        await self.socket.write_message(json.dumps({"id": self.count, "method": method, "params": parameters}))
        while True:
            told = json.loads(await self.socket.read_message())
            if told.get("method") == "Runtime.exceptionThrown":
                self.errors.append(told["params"]["exceptionDetails"]["exception"].get("description", "?"))
            if told.get("method") == "Log.entryAdded" and told["params"]["entry"]["source"] in ("security", "javascript"):
                self.errors.append(told["params"]["entry"]["text"])
            if told.get("id") == self.count:
                assert "error" not in told, (method, told)
                return told["result"]

    async def value(self, expression):
        told = await self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in told, told
        return told["result"].get("value")

    async def until(self, expression, seconds=300):
        end = time.monotonic() + seconds
        while not await self.value(expression):
            state = await self.value("document.body.innerText")
            assert time.monotonic() < end, f"{expression} does not come about:\n{state}"
            await asyncio.sleep(0.1)

    async def drop(self, path):
        """Drops a file on the page."""
        await self.value("scrollTo(0, 0)")
        x, y = await self.value("(r => [r.x + r.width / 2, r.y + r.height / 2])(document.getElementById('drop').getBoundingClientRect())")
        data = {"items": [], "files": [str(path)], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            await self.call("Input.dispatchDragEvent", type=kind, x=x, y=y, data=data)

    async def press(self, key, code=None, text=None):
        for kind in ("keyDown", "keyUp"):
            extra = {"text": text} if text and kind == "keyDown" else {}
            await self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code, **extra)

    async def tab_to(self, expression):
        """Reaches an element by the keyboard alone."""
        for _ in range(60):
            if await self.value(f"document.activeElement === {expression}"):
                return
            await self.press("Tab", 9)
        raise AssertionError(f"{expression} is not reached by the keyboard")

    async def picture(self, folder, name, width, dark):
        if folder is None:
            return
        # A tab behind another is drawn by nobody, and its picture never comes.
        await self.call("Page.bringToFront")
        await self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
        await self.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 600)
        wide = await self.value("document.documentElement.scrollWidth")
        assert wide <= width, f"{name}: {wide} pixels wide in a window of {width}"
        if width < 600:
            await self.value("document.getElementById('printed').open = true")
            said = await self.value("(e => [e.scrollWidth, e.clientWidth])(document.getElementById('said'))")
            assert said[0] <= said[1], f"{name}: what was printed is {said[0]} pixels wide in a box of {said[1]}"
        shot = await self.call("Page.captureScreenshot", captureBeyondViewport=True)
        (folder / f"{name}-{width}{'-dark' if dark else ''}.png").write_bytes(base64.b64decode(shot["data"]))


async def opened(port, address):
    from tornado.websocket import websocket_connect

    request = urllib.request.Request(f"http://127.0.0.1:{port}/json/new?{address}", method="PUT")
    told = json.load(urllib.request.urlopen(request))
    tab = Tab(await websocket_connect(told["webSocketDebuggerUrl"], max_message_size=1 << 28))
    for domain in ("Page", "Runtime", "Log"):
        await tab.call(f"{domain}.enable")
    await tab.until("document.readyState === 'complete' && !!document.getElementById('folder') && "
                    "document.getElementById('folder').textContent.startsWith('/')", 30)
    return tab


async def drive(port, address, log, work, pictures):
    shown = lambda id: f"!document.getElementById('{id}').hidden"
    one = await opened(port, address)
    wrong = work / "notes.txt"
    wrong.write_text("this is no log\nat all\n")
    await one.drop(wrong)
    await one.until(shown("bring-problem"), 30)
    print("wrong file:", await one.value("document.getElementById('bring-problem').textContent"))

    await one.drop(log)
    await one.until(shown("confirm"))
    # How much the torque's column is, a person knows.
    if await one.value(shown("constant-field")):
        await one.value("document.getElementById('constant').value = 0.5")
    # A plot tells the value under the pointer, in the column's unit.
    x, y = await one.value("(s => { s.scrollIntoView({block: 'center'}); const r = s.getBoundingClientRect(); "
                           "return [r.x + r.width / 2, r.y + r.height / 2] })(document.querySelectorAll('#rows svg')[1])")
    await one.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
    await one.until("/^row \\d+: [−\\d].* A$/.test(document.querySelectorAll('#rows .range')[1].children[1].textContent)", 10)
    for width, dark in ((1280, False), (390, False), (1280, True)):
        await one.picture(pictures, "confirm", width, dark)
    await one.tab_to("document.querySelector('#columns button')")
    await one.press("Enter", 13, "\r")
    await one.until(shown("findings"))
    await one.tab_to("document.getElementById('run')")
    await one.press("Enter", 13, "\r")
    await one.until(shown("work"))
    begun = time.monotonic()

    second = work / "second.csv"
    servo(second, 6000)
    two = await opened(port, address)
    await two.drop(second)
    await two.until(shown("confirm"))
    await two.value("document.querySelector('#columns button').click()")
    await two.until(shown("findings"))
    await two.value("document.getElementById('run').click()")
    await two.until("!document.getElementById('stop').hidden && document.querySelectorAll('#steps li').length > 0", 30)
    await two.value("document.getElementById('stop').click()")
    await two.until("document.getElementById('clock').textContent.includes('was stopped')", 30)
    print("two at a time: the second was stopped,", await two.value("document.getElementById('clock').textContent"))

    await one.until(f"{shown('results')} || !document.getElementById('clock').textContent.includes('so far')", 600)
    said = await one.value("document.getElementById('said').textContent")
    assert await one.value(shown("results")), said
    print(f"diagnosis: {time.monotonic() - begun:.1f} s")
    verdict = await one.value("document.getElementById('verdict').innerText")
    assert verdict.startswith("The model leaves out"), verdict
    print(" ".join(verdict.split()))
    for width, dark in ((1280, False), (390, False), (390, True)):
        await one.picture(pictures, "done", width, dark)
    # What the diagnosis of a phone says is not cut.
    await two.call("Emulation.setDeviceMetricsOverride", width=390, height=900, deviceScaleFactor=1, mobile=True)
    await two.value("document.getElementById('run').click()")
    await two.until(shown("results"), 600)
    await two.value("document.getElementById('printed').open = true")
    box = await two.value("(b => [b.scrollWidth, b.clientWidth])(document.getElementById('said'))")
    assert box[0] <= box[1], f"the box of {box[1]} pixels holds lines of {box[0]}"
    await two.picture(pictures, "phone", 390, False)
    reports = await one.value("[...document.querySelectorAll('#files a')].map(a => [a.textContent, a.href])")
    assert {"Open report.html", "Open circle.html", "Save axis.toml", "Save improved.fmu"} <= {t for t, _ in reports}, reports
    for name in ("Open report.html", "Open circle.html"):
        await one.call("Page.navigate", url=dict(reports)[name])
        await one.until("document.readyState === 'complete' && document.querySelectorAll('svg').length > 0", 30)
        assert await one.value("document.querySelector('h1').textContent")
        await one.picture(pictures, name.split()[1].split(".")[0], 1280, False)
    # A report is another origin: it cannot ask the page anything.
    assert await one.value("self.origin") == "null"
    errors = [e for e in one.errors + two.errors if "422" not in e]
    assert not errors, errors
    print("fine: dropped, confirmed, ran, opened")


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--eixo", default="eixo")
    arguments.add_argument("--log", type=Path)
    arguments.add_argument("--pictures", type=Path)
    given = arguments.parse_args()
    browser = next(filter(None, map(shutil.which, CHROMIUM)), None)
    if browser is None:
        print("SKIPPED: no Chromium (apt-get install chromium)")
        return
    if given.pictures:
        given.pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        log = given.log and given.log.resolve()
        if log is None:
            log = work / "servo.csv"
            servo(log, 2000)
        eixo = subprocess.Popen([given.eixo, "serve", "--folder", str(work / "logs")], stdout=subprocess.PIPE, text=True)
        profile = work / "profile"
        chromium = subprocess.Popen([browser, *SWITCHES.split(), f"--user-data-dir={profile}", "about:blank"], stderr=subprocess.DEVNULL)
        try:
            address = eixo.stdout.readline().strip()
            assert address.startswith("http://127.0.0.1:"), address
            told = profile / "DevToolsActivePort"
            end = time.monotonic() + 60
            while not (told.is_file() and told.read_text().strip()):
                assert time.monotonic() < end, "Chromium does not start"
                time.sleep(0.1)
            port = int(told.read_text().splitlines()[0])
            asyncio.run(drive(port, address, log, work, given.pictures))
        finally:
            for process in (chromium, eixo):
                process.terminate()
                process.wait(30)
            time.sleep(0.3)


if __name__ == "__main__":
    sys.exit(main())
