"""Compares the exported page in Chromium with vdi render, by real input events, and tests bad input. With the
argument speed it compares the CPU time of views instead, with the argument more it tests further kinds of windows and
GPUs."""
import base64
import io
import json
import math
import os
import resource
import sys

import numpy as np
from skimage import io as images

from pagetest import (HEIGHT, PICTURES, WIDTH, azimuth, bare, camera_of, check, compare, failures, final, message_of,
                      open_page, page_of, rendered, rendering, run, shown, vdi, whole)


def test_pictures(browser):
    common = ["--size", "40x36x32", "--resolution", f"{WIDTH}x{HEIGHT}", "--supersegments", "12"]
    cases = {"compact": ["--field", "mixing"], "full": ["--field", "coil", "--precision", "full"],
             "parallel": ["--field", "interface", "--parallel"],
             "margin": ["--field", "turbulence", "--zoom", "2", "--margin", "0.5"],
             "surface": ["--field", "turbulence", "--transfer-function", "surface"]}
    for name, words in cases.items():
        vdi("generate", *common, *words, "-o", f"{name}.vdi")
        open_page(browser, page_of(f"{name}.vdi"))
        whole(browser)
        bare(browser)
        start = camera_of(browser)
        angles = (0, 30, 90) if name == "compact" else (30,) if name in ("full", "surface") else (90,)
        vdi("render", f"{name}.vdi", "-o", f"{name}.png", "--resolution", f"{WIDTH}x{HEIGHT}", "--azimuth", *angles)
        for degrees in angles:
            camera = azimuth(start, degrees)
            browser.value(f"vdiPage.setCamera({json.dumps(camera)}, false)")
            expected = images.imread(f"{name}_{degrees}deg.png" if len(angles) > 1 else f"{name}.png")[..., :3]
            compare(f"{name}, {degrees} degrees", shown(browser, f"{name}_{degrees}"), expected)
        if name in ("compact", "parallel"):
            browser.value("document.getElementById('smooth').click()")
            compare(f"{name}, constant", shown(browser), rendered(f"{name}.vdi", camera, "constant"))
        check(not browser.complaints(), f"{name}: {browser.complaints()}")


SMALL = """
(() => {
  const most = 64, {prototype} = WebGL2RenderingContext, {getParameter, getError} = prototype;
  window.refused = [];  // calls that exceed the limit, which a GPU answers with an error
  let isWrong = false;
  prototype.getParameter = function(name) {
    if (name === this.MAX_TEXTURE_SIZE || name === this.MAX_RENDERBUFFER_SIZE) return most;
    return name === this.MAX_VIEWPORT_DIMS ? new Int32Array([most, most]) : getParameter.call(this, name);
  };
  prototype.getError = function() {
    const was = isWrong;
    isWrong = false;
    return was ? this.INVALID_VALUE : getError.call(this);
  };
  const places = {texImage2D: 3, texStorage2D: 3, texImage3D: 3, texStorage3D: 3, renderbufferStorage: 2,
                  renderbufferStorageMultisample: 3, viewport: 2};
  for (const [name, place] of Object.entries(places)) {
    const call = prototype[name];
    prototype[name] = function(...words) {
      if (Math.max(words[place], words[place + 1]) <= most) return call.apply(this, words);
      window.refused.push([name, words[place], words[place + 1]]);
      isWrong = true;
    };
  }
})();"""


def test_small_textures(browser):
    """A GPU whose textures are 64 texels wide and high: lists and supersegments take several layers, and the picture
    of a larger window is that of a canvas of 64 pixels."""
    script = browser.send("Page.addScriptToEvaluateOnNewDocument", source=SMALL)["identifier"]
    open_page(browser, "compact.html")
    whole(browser)
    bare(browser)
    camera = azimuth(camera_of(browser), 30)
    browser.value(f"vdiPage.setCamera({json.dumps(camera)}, false)")
    final(browser)
    got = png_of(browser, "")[..., :3]
    seen = shown(browser, "small_textures")
    check(got.shape[:2] == (36, 64) and seen.any(), f"the canvas is as large as the GPU allows: {got.shape}, {seen.max()}")
    if failures:
        return
    compare("small textures", got, rendered("compact.vdi", camera, size=(64, 36)))
    extents = [[np.ptp(places) for places in np.nonzero(picture.max(axis=2) > 20)] for picture in (got, seen)]
    check(np.allclose(3 * np.array(extents[0]), extents[1], atol=6), f"the browser stretches the canvas: {extents}")
    browser.value("vdiPage.setCamera(vdiPage.vdi.camera); vdiPage.viewer.cost = 0.1")  # coarse pictures, then strips
    final(browser)
    check(browser.value("refused.length === 0 && vdiPage.viewer.renderer.gl.getError() === 0"),
          f"the GPU refuses {browser.value('refused')}")
    browser.send("Page.removeScriptToEvaluateOnNewDocument", identifier=script)


def angle_of(browser):
    return float(browser.value("document.getElementById('angle').textContent").rstrip("°"))


def check_culling(browser):
    """Culled regions show nothing: views from anywhere, also from inside the scene, equal those without culling."""
    browser.value("""window.both = (camera, scale) => {
      const {renderer} = vdiPage.viewer, {gl} = renderer;
      const {width, height} = renderer.pictureSize(scale), half = Math.floor(height / 2);
      const draw = () => {
        for (const [first, end] of [[0, half], [half, height]]) renderer.drawPicture(camera, scale, first, end);
        const pixels = new Uint8Array(4 * width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        return pixels;
      };
      const culled = draw();
      gl.bindFramebuffer(gl.FRAMEBUFFER, renderer.regions.framebuffer);
      const shows = new Uint8Array(4 * Math.ceil(width / 16) * Math.ceil(height / 16));
      gl.readPixels(0, 0, Math.ceil(width / 16), Math.ceil(height / 16), gl.RGBA, gl.UNSIGNED_BYTE, shows);
      renderer.findRegions = () => {
        gl.bindFramebuffer(gl.FRAMEBUFFER, renderer.regions.framebuffer);
        gl.disable(gl.SCISSOR_TEST);
        gl.clearColor(1, 1, 1, 1);
        gl.clear(gl.COLOR_BUFFER_BIT);
        gl.enable(gl.SCISSOR_TEST);
      };
      const whole = draw();
      delete renderer.findRegions;
      return {same: culled.every((value, i) => value === whole[i]), seen: whole.some((value) => value > 0),
              blank: shows.filter((value) => value === 0).length / shows.length};
    }; 0""")
    start = camera_of(browser)
    low, high = map(np.array, browser.value("vdiPage.vdi.bounds"))
    size = np.max(high - low)
    random = np.random.RandomState(3)
    blank, seen = [], 0
    for i in range(12):
        reach = size * (0.1, 0.4, 0.8, 1.5, 3)[i % 5]
        camera = {**start, "position": list((low + high) / 2 + reach * random.normal(size=3)),
                  "focalPoint": list((low + high) / 2 + 0.2 * size * random.normal(size=3)),
                  "viewUp": list(random.normal(size=3)), "viewAngle": (10, 30, 90, 140)[i % 4],
                  "parallelScale": size * (0.1, 0.5, 1)[i % 3]}
        view = browser.value(f"both({json.dumps(camera)}, {(1, 2.25)[i % 2]})")
        check(view["same"], f"culling changes the view of {camera}")
        blank.append(view["blank"])
        seen += view["seen"]
    print(f"culled {np.mean(blank):.2f} of the regions of {len(blank)} views, {seen} of which show something", flush=True)
    check(seen > 6 and 0.1 < np.mean(blank) < 0.9, "views show something, and regions are culled")


def test_culling_perspective(browser):
    open_page(browser, "compact.html")
    whole(browser)
    check_culling(browser)


def test_culling_parallel(browser):
    open_page(browser, "parallel.html")
    whole(browser)
    check_culling(browser)


def test_hands(browser):
    views = []  # vdi render makes the expected pictures while the test continues

    def look(what):
        expected = rendering("compact.vdi", camera_of(browser))
        views.append((what, shown(browser), expected))

    open_page(browser, "compact.html")
    whole(browser)
    bare(browser)
    home = camera_of(browser)
    browser.drag((90, 50), (126, 50))
    check(45 < angle_of(browser) < 65, f"a third of the height turns by 60 degrees or less, not {angle_of(browser)}")
    look("mouse orbit")
    browser.wait("location.hash.includes('camera=')")
    link = browser.value("location.hash")
    before = camera_of(browser)
    browser.mouse("mouseWheel", 90, 50, deltaX=0, deltaY=-300)
    distance = [np.linalg.norm(np.subtract(c["position"], c["focalPoint"])) for c in (before, camera_of(browser))]
    check(distance[1] < 0.8 * distance[0], f"the wheel zooms: {distance}")
    browser.drag((90, 50), (90, 70), button="middle", buttons=4)
    check(camera_of(browser)["focalPoint"] != before["focalPoint"], "the middle button pans")
    browser.key("[")
    check(abs(np.dot(camera_of(browser)["viewUp"], before["viewUp"])) < 0.9999, "a key rolls")
    look("zoomed, panned and rolled")
    browser.key("Home")
    browser.wait("vdiPage.viewer.camera === vdiPage.vdi.camera")
    check(camera_of(browser) == home, "Home is the view as made")
    look("as made")
    browser.wait("location.hash === ''")

    browser.send("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
    browser.touch("touchStart", (90, 50))
    for x in range(92, 120, 3):
        browser.touch("touchMove", (x, 50))
    browser.touch("touchEnd")
    check(20 < angle_of(browser) < 60, f"a finger orbits: {angle_of(browser)}")
    look("touch orbit")
    before = camera_of(browser)
    browser.touch("touchStart", (80, 50), (100, 50))
    for step in range(1, 11):
        browser.touch("touchMove", (80 - step, 50), (100 + step, 50))
    browser.touch("touchEnd")
    distance = [np.linalg.norm(np.subtract(c["position"], c["focalPoint"])) for c in (before, camera_of(browser))]
    check(0.3 < distance[1] / distance[0] < 0.7, f"two fingers zoom: {distance}")
    browser.send("Emulation.setTouchEmulationEnabled", enabled=False)

    for what, got, expected in views:
        compare(what, got, expected())

    open_page(browser, "compact.html", link)
    whole(browser)
    check(abs(angle_of(browser) - 58) < 12, f"a link keeps the view: {angle_of(browser)}")
    for damaged in ("#camera=1,2,3", "#camera=NaN,1,1,1,1,1,1,1,1,1", "#frame=-7&camera=", "#frame=1e9"):
        open_page(browser, "compact.html", damaged)
        whole(browser)
        check(angle_of(browser) == 0, f"{damaged} is ignored")


def test_narrow_window(browser):
    """In a window narrower than the VDI's picture, material follows the pointer, too."""
    browser.size(HEIGHT, WIDTH)
    open_page(browser, "compact.html")
    whole(browser)
    bare(browser)
    before = camera_of(browser)
    browser.drag((54, 100), (74, 80), modifiers=8)  # shift
    moved = np.linalg.norm(np.subtract(camera_of(browser)["focalPoint"], before["focalPoint"]))
    distance = np.linalg.norm(np.subtract(before["position"], before["focalPoint"]))
    framed = HEIGHT * HEIGHT / WIDTH  # pixels that the picture's height takes
    pixels = moved * framed / (2 * distance * math.tan(math.radians(before["viewAngle"] / 2)))
    check(abs(pixels - math.hypot(20, 20)) < 0.5, f"a drag by 28 pixels pans by {pixels}")
    browser.size(WIDTH, HEIGHT)


def test_screenshot(browser):
    """A screenshot that is taken while strips are drawn leaves the whole picture on show."""
    open_page(browser, "compact.html")
    whole(browser)
    bare(browser)
    camera = azimuth(camera_of(browser), 20)
    rows = browser.value(f"""new Promise((done) => {{
      const {{viewer}} = vdiPage;
      viewer.cost = 0.1;  // so slow that a picture takes many strips
      vdiPage.setCamera({json.dumps(camera)}, false);
      const look = () => {{
        const rows = viewer.nextRow;
        if (rows === 0) requestAnimationFrame(look);
        else viewer.screenshot().then(() => done(rows));
      }};
      look();
    }})""")
    check(0 < rows < HEIGHT, f"strips up to row {rows} are drawn")
    compare("after a screenshot", shown(browser), rendered("compact.vdi", camera))


def drop_files(browser, *paths):
    root = browser.send("DOM.getDocument")["root"]["nodeId"]
    node = browser.send("DOM.querySelector", nodeId=root, selector="#files")["nodeId"]
    browser.value("document.getElementById('message').hidden = true")
    browser.send("DOM.setFileInputFiles", nodeId=node, files=[os.path.abspath(path) for path in paths])


def test_damage(browser):
    with open("compact.vdi", "rb") as file:
        sound = file.read()
    cases = {"truncated": sound[:len(sound) // 2], "empty": b"", "no_vdi": b"hello" * 100,
             "flipped": sound[:5000] + bytes([sound[5000] ^ 16]) + sound[5001:],
             "later": sound[:8] + b"\x09" + sound[9:]}
    open_page(browser, "compact.html")
    whole(browser)
    bare(browser)
    before = shown(browser)
    for name, data in cases.items():
        with open(f"{name}.vdi", "wb") as file:
            file.write(data)
        drop_files(browser, f"{name}.vdi")
        browser.wait("!message.hidden && !message.textContent.startsWith('Reading')")
        message = message_of(browser)
        check(message.startswith("invalid .vdi file: ") and "\n" not in message, f"{name}: {message}")
        browser.value("document.getElementById('message').hidden = true")
        check(np.array_equal(shown(browser), before), f"{name}: what was shown stays")
    drop_files(browser, "full.vdi")
    browser.wait("!vdiPage.vdi.compact")
    check(message_of(browser) == "", "a sound file can be opened after damaged ones")
    browser.value("window.former = vdiPage.vdi; 0")
    drop_files(browser, "full.vdi")
    browser.wait("vdiPage.vdi !== former")
    check(browser.value("vdiPage.source.nameOf(0)") == "full.vdi", "the same file can be opened once more")
    check(not browser.complaints(), f"damage: {browser.complaints()}")

    with open("compact.html", encoding="utf-8") as file:
        text = file.read()
    start = text.index('data-size="')
    begin = text.index(">", start) + 1
    end = text.index("</script>", begin)
    data = text[begin:end]
    flipped = bytearray(base64.b64decode(data))
    flipped[len(flipped) // 2] ^= 4
    damaged = {"cut": text[:begin] + data[:len(data) // 2 // 4 * 4] + text[end:],
               "letters": text[:begin] + data[:1000] + "!!" + data[1002:] + text[end:],
               "size": text[:start] + 'data-size="99999999999"' + text[begin - 1:],
               "flip": text[:begin] + base64.b64encode(flipped).decode() + text[end:]}
    for name, page in damaged.items():
        with open("damaged.html", "w", encoding="utf-8") as file:
            file.write(page)
        open_page(browser, "damaged.html")
        browser.wait("!document.getElementById('message').hidden && !message.textContent.startsWith('Reading')")
        check("damaged" in message_of(browser) or "invalid .vdi file" in message_of(browser), f"{name}: {message_of(browser)}")
        drop_files(browser, "full.vdi")
        browser.wait("vdiPage.vdi && !vdiPage.vdi.compact")


def test_without_webgl(browser):
    script = browser.send("Page.addScriptToEvaluateOnNewDocument",
                          source="HTMLCanvasElement.prototype.getContext = () => null;")["identifier"]
    open_page(browser, "compact.html")
    browser.wait("!document.getElementById('message').hidden")
    check("WebGL2" in message_of(browser), f"without WebGL2: {message_of(browser)}")
    browser.send("Page.removeScriptToEvaluateOnNewDocument", identifier=script)


def test_series(browser):
    for i, seed in enumerate((1, 2, 3)):
        vdi("generate", "--field", "turbulence", "--size", "24x24x24", "--resolution", f"{WIDTH}x{HEIGHT}", "--supersegments",
            "8", "--seed", seed, "-o", f"step_{i}.vdi")
    open_page(browser, page_of(*[f"step_{i}.vdi" for i in range(3)], title="<Three> & \"steps\""))
    whole(browser)
    check(browser.value("document.title") == "<Three> & \"steps\"", "a title of any letters")
    bare(browser)
    browser.value("(() => { const s = document.getElementById('frame'); s.value = 2; s.dispatchEvent(new Event('input')); })()")
    browser.wait("vdiPage.frame === 2")
    compare("third frame", shown(browser), rendered("step_2.vdi", camera_of(browser)))
    browser.wait("location.hash === '#frame=2'")
    check_quick_clicks(browser)


def check_quick_clicks(browser):
    """Presses Play, and once a frame is on show, Pause and Play: the first loop ends, and the second one plays on."""
    played = browser.value("""(async () => {
      const page = vdiPage, button = document.getElementById('play'), first = page.frame;
      const asked = [];
      page.show = (frame) => {
        asked.push([frame, performance.now()]);
        return Object.getPrototypeOf(page).show.call(page, frame);
      };
      const until = async (holds) => { while (!holds()) await new Promise((done) => setTimeout(done, 5)); };
      button.click();
      await until(() => page.frame !== first);
      asked.length = 0;
      button.click();
      button.click();
      await until(() => asked.length > 6 || !page.isPlaying);
      const plays = page.isPlaying;
      if (plays) button.click();
      delete page.show;
      return {plays, frames: asked.map(([frame]) => frame), times: asked.map(([, time]) => time)};
    })()""")
    check(played["plays"], f"a series plays on after Play, Pause and Play: {played}")
    check(all(step % 3 == 1 for step in np.diff(played["frames"])), f"each frame follows the previous one: {played}")
    # A loop waits a tenth of a second between frames; two loops would take turns.
    check(min(np.diff(played["times"]), default=0) > 90, f"one loop plays: {played}")
    check(not browser.value("vdiPage.isPlaying"), "the button stops a series")


def test_legend(browser):
    """The VDI with metadata comes from a source that the test provides."""
    browser.size(600, 400)
    open_page(browser, "step_0.html")
    whole(browser)
    browser.value("""(async () => {
      const vdi = vdiPage.vdi;
      const coloring = {array: {name: "velocity <b>", association: "points", components: 3, component: -1}, range: [-1, 12],
        transferFunction: {colors: [[-2, 0, 0, 1], [5, 1, 1, 0], [5, 0, 1, 0], [12.5, 1, 0, 0]], opacities: [],
                           unitDistance: 1}};
      const source = {count: 1, nameOf: () => "live", load: async () => ({...vdi, coloring, timeStep: 7, time: 0.25})};
      await vdiPage.open(source);
    })()""")
    whole(browser)
    legend = browser.value("document.getElementById('legend').innerText").split()
    check(legend[:3] == ["velocity", "<b>,", "magnitude"], f"the colour bar's title: {legend}")
    numbers = set(legend[3:])
    check({"-2.0", "12.5"} <= numbers <= {"-2.0", "12.5", "0", "5.0", "10.0"}, f"the colour bar's numbers: {legend}")
    facts = browser.value("document.getElementById('facts').textContent")
    check("step 7" in facts and "t = 0.25" in facts, f"step and time: {facts}")
    picture = images.imread(io.BytesIO(browser.screenshot(os.path.join(PICTURES, "legend.png"))))
    box = browser.value("(({x, y, width, height}) => [x, y, width, height])"
                        "(document.querySelector('#legend .bar').getBoundingClientRect())")
    column = int(box[0] + box[2] / 2)
    ends = [picture[int(box[1] + share * box[3]), column, :3].astype(int) for share in (0.03, 0.97)]
    check(ends[0][0] > 200 > 60 > ends[0][2] and ends[1][2] > 200 > 60 > ends[1][0], f"red at the top, blue below: {ends}")
    drop_files(browser, "full.vdi")
    browser.wait("!vdiPage.vdi.compact")
    known = browser.value("vdiPage.vdi.coloring !== undefined")
    check(browser.value("document.getElementById('legend').hidden") != known, "without metadata there is no bar")
    browser.size(WIDTH, HEIGHT)


TIMED = 4       # pictures
MOST_TIMES = 4  # CPU time of the page's smooth picture per that of vdi render


def render_time(degrees, *words):
    """CPU time of a picture by vdi render with these words, its PNG included, in ms: the mean of some that are at these
    degrees or a little more or less."""
    def spent(*azimuths):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        vdi("render", *words, "-o", "timed.png", "--azimuth", *azimuths)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return 1000 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)

    around = [degrees + step for step in range(-TIMED // 2, TIMED // 2 + 1)]
    many, one = (min(spent(*azimuths) for _ in range(2)) for azimuths in (around, [degrees]))
    return (many - one) / (len(around) - 1)


def page_time(browser, sheared):
    """The least CPU time of some pictures by the page, in ms. SwiftShader draws in the browser's GPU process."""
    def spent():
        processes = browser.send("SystemInfo.getProcessInfo", browser=True)["processInfo"]
        return 1000 * sum(process["cpuTime"] for process in processes if process["type"] == "GPU")

    def timed():
        before = spent()
        browser.value(f"""(() => {{
          const viewer = vdiPage.viewer, gl = viewer.renderer.gl;
          viewer.renderer.drawPicture(viewer.camera, 1, 0, viewer.canvas.height, {json.dumps(sheared)});
          gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
        }})()""")
        return spent() - before

    return min(timed() for _ in range(TIMED))


def test_frame_time(browser):
    """CPU time, which depends less than wall-clock time on other work of the machine."""
    browser.size(640, 360)
    for field in ("mixing", "coil"):
        vdi("generate", "--field", field, "--size", "48x48x48", "--resolution", "640x360", "--supersegments", "12",
            "-o", f"{field}.vdi")
        open_page(browser, page_of(f"{field}.vdi"))
        final(browser)
        start = camera_of(browser)
        for reconstruction in ("smooth", "sheared"):
            for degrees in (10, 30, 90):
                browser.value(f"vdiPage.setCamera({json.dumps(azimuth(start, degrees))}, false)")
                final(browser)
                page = page_time(browser, reconstruction == "sheared")
                device = render_time(degrees, f"{field}.vdi", "--reconstruction", reconstruction)
                print(f"{field}, 640 x 360, {reconstruction}, {degrees} degrees: page {page:.0f} ms of CPU time, "
                      f"vdi render {device:.0f} ms, {page / device:.1f} times", flush=True)
                # Some sheared pictures are so close to this that a busy machine would decide.
                check(reconstruction == "sheared" or page <= MOST_TIMES * device,
                      f"the page takes {page / device:.1f} times as long as vdi render")
    with open("mixing.vdi", "rb") as file, open("mixing.html", "rb") as page:
        ratio = len(page.read()) / len(file.read())
    print(f"page of one VDI: {ratio:.3f} times the .vdi file", flush=True)
    check(ratio < 1.5, f"the page takes {ratio} times the .vdi file")
    browser.size(WIDTH, HEIGHT)


def png_of(browser, words):
    """The picture of viewer.screenshot, with its alpha."""
    return images.imread(io.BytesIO(base64.b64decode(browser.value(
        f"vdiPage.viewer.screenshot({words}).then((blob) => new Promise((done) => {{ const reader = new FileReader();"
        " reader.onload = () => done(reader.result.split(',')[1]); reader.readAsDataURL(blob); }))"))))


def slide(browser, label, share):
    browser.value(f"""(() => {{ const slider = document.querySelector('[aria-label="{label}"]');
      slider.value = {share} * slider.max; slider.dispatchEvent(new Event('input')); }})()""")


def test_clipping(browser):
    """Clipping by planes shows what vdi render --clip shows."""
    for name in ("compact", "parallel"):
        open_page(browser, f"{name}.html")
        whole(browser)
        bare(browser)
        camera = azimuth(camera_of(browser), 30)
        browser.value(f"vdiPage.setCamera({json.dumps(camera)}, false)")
        low, high = browser.value("vdiPage.vdi.bounds")
        slide(browser, "Clip x from", 0.4)
        slide(browser, "Clip z to", 0.7)
        x, z = low[0] + 0.4 * (high[0] - low[0]), low[2] + 0.7 * (high[2] - low[2])
        whole_picture = rendering(f"{name}.vdi", camera)
        expected = rendering(f"{name}.vdi", camera, more=["--clip", x, 0, 0, 1, 0, 0, "--clip", 0, 0, z, 0, 0, -1])()
        check(np.abs(whole_picture().astype(int) - expected).max() > 50, "the planes cut something off")
        compare(f"{name}, clipped", shown(browser, f"{name}_clipped"), expected)
    browser.value("document.querySelector('#clip button').click()")
    compare("nothing is clipped any more", shown(browser), rendered("parallel.vdi", camera))


def test_screenshots(browser):
    """Screenshots of another size, and without a background."""
    open_page(browser, "compact.html")
    whole(browser)
    bare(browser)
    camera = azimuth(camera_of(browser), 20)
    browser.value(f"vdiPage.setCamera({json.dumps(camera)}, false)")
    final(browser)
    size = (3 * WIDTH, 3 * HEIGHT)
    large = png_of(browser, f"[{size[0]}, {size[1]}]")[..., :3]
    compare("a large screenshot", large, rendered("compact.vdi", camera, size=size))
    compare("the view after it", shown(browser), rendered("compact.vdi", camera))
    flat = png_of(browser, f"[{size[0]}, {size[1]}], true")
    check(flat.shape[2] == 4 and flat[0, 0, 3] == 0 and flat[..., 3].max() > 100, f"a transparent background: {flat.shape}")
    on_black = (flat[..., :3] * (flat[..., 3:] / 255)).round().astype(np.uint8)
    compare("a transparent screenshot", on_black, rendered("compact.vdi", camera, size=size))
    refused = browser.value("vdiPage.viewer.screenshot([1e6, 1]).catch((error) => error.message)")
    check("at most" in refused, f"a size that the GPU doesn't have: {refused}")


def test_tools(browser):
    """Axis views, the point that the view orbits, turning, recording, links and help, by mouse, touch and keys."""
    browser.size(640, 400)
    open_page(browser, "compact.html")
    whole(browser)

    def direction():
        camera = camera_of(browser)
        way = np.subtract(camera["position"], camera["focalPoint"])
        return np.round(way / np.linalg.norm(way), 6).tolist()

    browser.key("x")
    browser.wait("Math.abs(vdiPage.viewer.camera.position[1] - vdiPage.viewer.camera.focalPoint[1]) < 1e-9")
    check(direction() == [1, 0, 0], f"x: {direction()}")
    browser.key("Home")
    browser.wait("vdiPage.viewer.camera === vdiPage.vdi.camera")
    x, y = browser.value("(({x, y, width, height}) => [x + width / 2, y + height / 2])"
                         "(document.querySelector('#axes [data-side=\"+z\"] .target').getBoundingClientRect())")
    browser.drag((x, y), (x, y), steps=0)
    browser.wait("Math.abs(vdiPage.viewer.camera.position[0] - vdiPage.viewer.camera.focalPoint[0]) < 1e-9")
    check(direction() == [0, 0, 1], f"a click on the triad: {direction()}")
    browser.value("document.querySelector('#sides [data-side=\"-y\"]').click()")
    browser.wait("Math.abs(vdiPage.viewer.camera.position[2] - vdiPage.viewer.camera.focalPoint[2]) < 1e-9")
    check(direction() == [0, -1, 0], f"a button: {direction()}")

    # The pivot: on the surface that the pixel shows, and fixed in the picture while the view turns.
    browser.key("Home")
    browser.wait("vdiPage.viewer.camera === vdiPage.vdi.camera")
    check(browser.value("vdiPage.pivot === undefined"), "no point is chosen at first")
    for count in (1, 2):
        browser.mouse("mousePressed", 330, 170, button="left", buttons=1, clickCount=count)
        browser.mouse("mouseReleased", 330, 170, button="left", clickCount=count)
    pivot = browser.value("vdiPage.pivot")
    low, high = browser.value("vdiPage.vdi.bounds")
    check(pivot and all(a - 0.1 <= at <= b + 0.1 for a, at, b in zip(low, pivot, high)),
          f"a double click: {pivot}, {low}, {high}")
    check(not browser.value("document.getElementById('mark').hidden"), "the point is marked")

    def place_of(point):
        half, right_of, above = browser.value("(({renderer}) => [renderer.framedHeight() / 2, ...renderer.framedMiddle()]"
                                              ".map((n) => n / devicePixelRatio))(vdiPage.viewer)")
        camera = camera_of(browser)
        forward = np.subtract(camera["focalPoint"], camera["position"])
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, camera["viewUp"])
        right /= np.linalg.norm(right)
        offset = np.subtract(point, camera["position"])
        scale = half / math.tan(math.radians(camera["viewAngle"] / 2)) / (offset @ forward)
        return np.array([320 + right_of + scale * (offset @ right), 200 - above - scale * (offset @ np.cross(right, forward))])

    check(np.allclose(place_of(pivot), (330, 170), atol=1), f"the chosen point is where the click was: {place_of(pivot)}")
    browser.drag((100, 100), (180, 130))
    cameras = (browser.value("vdiPage.vdi.camera"), camera_of(browser))
    distance = [np.linalg.norm(np.subtract(camera["position"], pivot)) for camera in cameras]
    check(abs(distance[0] - distance[1]) < 1e-6 * distance[0], f"the view orbits that point: {distance}")
    browser.send("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
    for _ in range(2):
        browser.touch("touchStart", (300, 200))
        browser.touch("touchEnd")
    check(browser.value("vdiPage.pivot") != pivot, "a double tap chooses another point")
    browser.send("Emulation.setTouchEmulationEnabled", enabled=False)

    browser.value("window.saved = [];"
                  "HTMLAnchorElement.prototype.click = function() { saved.push([this.download, blobs.pop()]); };"
                  "window.blobs = []; URL.createObjectURL = (blob) => { blobs.push(blob); return 'blob:none'; };"
                  "(({prototype}) => { const {start} = prototype; prototype.start = function(...words) { window.recorded = 0;"
                  " this.addEventListener('dataavailable', ({data}) => recorded += data.size); start.apply(this, words); }; })"
                  "(MediaRecorder); 0")
    browser.value("document.getElementById('view').focus()")
    browser.key("t")
    before = camera_of(browser)
    browser.wait(f"vdiPage.viewer.camera.position[0] !== {before['position'][0]}")
    browser.key("r")
    browser.wait("!document.getElementById('recording').hidden")
    browser.wait("window.recorded > 2000")  # a busy machine may take a while to encode its first picture
    browser.value("document.getElementById('recording').click()")
    browser.key("t")
    browser.wait("saved.length === 1")
    video = browser.value("saved[0][1].arrayBuffer().then((data) => [data.byteLength, [...new Uint8Array(data).slice(0, 4)]])")
    check(video[0] > 1000 and video[1] == [0x1A, 0x45, 0xDF, 0xA3], f"a recording is a WebM file: {video}")
    check(browser.value("saved[0][0]").endswith(".webm"), "a recording is WebM")

    browser.value("document.getElementById('link').click()")
    link = browser.value("document.getElementById('sharelink').value")
    check("#camera=" in link and "token" not in link, f"a link: {link}")
    check(browser.value("document.getElementById('askfortoken').hidden"), "a page without a server has no token to share")
    browser.value("document.getElementById('share').close(); document.getElementById('view').focus()")
    browser.key("?")
    check(browser.value("document.getElementById('help').open"), "the help opens by its key")
    browser.screenshot(os.path.join(PICTURES, "help.png"))
    browser.value("document.querySelector('#help button').click()")
    browser.wait("!document.getElementById('help').open")
    check(not browser.complaints(), f"tools: {browser.complaints()}")
    browser.size(WIDTH, HEIGHT)


def test_looks(browser):
    """Nothing is cut off, on screens of all kinds. The pictures are for people to inspect."""
    phone, desktop = (360, 640), (1000, 640)
    for name, size, scheme in (("phone", phone, "light"), ("desktop", desktop, "light"), ("desktop", desktop, "dark")):
        browser.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        browser.size(*size)
        open_page(browser, "step_0.html")
        whole(browser)
        browser.screenshot(os.path.join(PICTURES, f"{name}_{scheme}.png"))
        browser.value("document.getElementById('look').open = true")
        browser.screenshot(os.path.join(PICTURES, f"{name}_{scheme}_view.png"))
        inside = browser.value("""
          [...document.querySelectorAll('#bar > *, #look > div, header, #axes')].filter((e) => !e.hidden).every((e) => {
          const box = e.getBoundingClientRect();
          return box.left >= 0 && box.right <= innerWidth && box.top >= 0 && box.bottom <= innerHeight;
        })""")
        check(inside, f"{name}, {scheme}: all is inside of the window")
        below = browser.value("document.getElementById('axes').getBoundingClientRect().bottom - "
                              "document.getElementById('bar').getBoundingClientRect().top")
        check(below <= 0, f"{name}, {scheme}: the axes are above the bar")
        paper = browser.value("vdiPage.viewer.background[0]")
        check(paper < 0.2 if scheme == "dark" else paper > 0.8, f"{scheme}: the background is {paper}")
    browser.send("Emulation.setEmulatedMedia", features=[])
    browser.size(WIDTH, HEIGHT)


def test_first_look(browser):
    """Keys work from the start, and in a narrow window the colour bar is below the header."""
    browser.size(320, 568)
    open_page(browser, "step_0.html")
    whole(browser)
    before = camera_of(browser)
    browser.key("ArrowLeft")
    check(camera_of(browser) != before, "an arrow turns a page that was only opened")
    gap = browser.value("""(() => {
      const [header, legend] = [document.querySelector('header'), document.getElementById('legend')];
      document.getElementById('facts').textContent = 'a long line of facts '.repeat(9);
      [legend.hidden, legend.textContent] = [false, 'velocity'];
      return legend.getBoundingClientRect().top - header.getBoundingClientRect().bottom;
    })()""")
    check(gap >= 0, f"the colour bar is {gap} pixels below the header")
    browser.size(WIDTH, HEIGHT)


def test_framing(browser):
    """In windows of all sizes, neither the bar nor the colour bar nor the header covers the scene."""
    cube = "cube.vdi"
    with open("cube.json", "w", encoding="utf-8") as file:
        json.dump({"colors": [[0, 0.2, 0.4, 1], [1, 1, 0.3, 0.1]], "opacities": [[0, 1], [1, 1]], "relative": True}, file)
    vdi("generate", "--field", "mixing", "--size", "16x16x16", "--resolution", "160x90", "--supersegments", "4",
        "--transfer-function", "cube.json", "-o", cube)
    open_page(browser, page_of(cube, "parallel.vdi"))
    whole(browser)
    for width, height in ((360, 240), (320, 568), (1000, 300)):
        browser.size(width, height)
        for frame in (0, 1):
            browser.value(f"vdiPage.show({frame})")
            whole(browser)
            browser.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
            final(browser)
            picture = png_of(browser, "")[..., :3].astype(int)
            browser.screenshot(os.path.join(PICTURES, f"framing_{width}_{frame}.png"))
            rows, columns = np.nonzero(np.abs(picture - picture[-1, -1]).max(axis=2) > 8)
            check(np.ptp(columns) > 30 and np.ptp(rows) > 30, f"{width} x {height}: the scene can be seen")
            for panel in ("bar", "legend", "header"):
                left, top, right, bottom = browser.value(
                    f"(({{left, top, right, bottom}}) => [left, top, right, bottom])"
                    f"(document.getElementById('{panel}').getBoundingClientRect())")
                covered = (columns >= left) & (columns < right) & (rows >= top) & (rows < bottom)
                check(not covered.any(), f"{width} x {height}, frame {frame}: the {panel} covers {covered.sum()} pixels")
    # A finger goes through the colour bar, which the user can hide.
    browser.value("vdiPage.show(0)")
    legend = browser.value("(({x, y, width, height}) => [x + width / 2, y + height / 2])"
                           "(document.getElementById('legend').getBoundingClientRect())")
    check(browser.value(f"document.elementFromPoint({legend[0]}, {legend[1]}).closest('#view') !== null"),
          "the colour bar takes no input")
    browser.value("document.getElementById('scale').click()")
    check(browser.value("document.getElementById('legend').hidden"), "the colour bar can be hidden")
    browser.value("vdiPage.show(1)")
    check(browser.value("document.getElementById('legend').hidden"), "it stays hidden")
    browser.size(WIDTH, HEIGHT)


def test_many_contexts(browser):
    """A browser takes the context of a page when others open too many. The page takes another when the user turns to it."""
    open_page(browser, "compact.html")
    whole(browser)
    bare(browser)
    camera = azimuth(camera_of(browser), 15)
    browser.value(f"vdiPage.setCamera({json.dumps(camera)}, false)")
    browser.value("""(() => {
      window.others = Array.from({length: 17}, () => document.createElement('canvas').getContext('webgl2'));
    })()""")
    browser.wait("vdiPage.viewer.isLost")
    check("lost" in message_of(browser), f"a lost context is reported: {message_of(browser)}")
    browser.value("new Promise((done) => setTimeout(done, 1100))")
    browser.mouse("mousePressed", 90, 50, button="left", buttons=1, clickCount=1)
    browser.mouse("mouseReleased", 90, 50, button="left", clickCount=1)
    browser.wait("!vdiPage.viewer.isLost")
    compare("after a lost context", shown(browser), rendered("compact.vdi", camera))
    check(message_of(browser) == "", f"the message disappears: {message_of(browser)}")
    browser.drag((90, 50), (110, 50))
    check(camera_of(browser)["position"] != camera["position"], "the new canvas can be dragged")


def test_opening(browser):
    """While a second file is read, the page says so. The latest choice wins, also if it is a wrong file."""
    open_page(browser, "compact.html")
    whole(browser)
    browser.value("""(() => {
      window.said = [];
      new MutationObserver(() => said.push(message.textContent)).observe(message, {childList: true});
    })()""")
    drop_files(browser, "full.vdi")
    browser.wait("vdiPage.vdi && !vdiPage.vdi.compact")
    check("Reading full.vdi…" in browser.value("said"), f"what the page says: {browser.value('said')}")
    check(browser.value("document.title") == "full.vdi", "the tab has the file's name")
    sources = browser.value("""(async () => {
      const {source, decoder} = vdiPage, {decode} = decoder;
      const file = (name, bytes) => new File([bytes], name);
      let begun;
      const decoding = new Promise((done) => { begun = done; });
      decoder.decode = async (encoded, isWanted) => {
        begun();
        await new Promise((done) => setTimeout(done, 200));
        if (!isWanted()) window.isAbandoned = true;
        return decode.call(decoder, encoded, isWanted);
      };
      const bytes = await decodeText();
      const slow = vdiPage.openFiles([file('slow.vdi', bytes)]);
      await decoding;
      await vdiPage.openFiles([file('wrong.vdi', 'wrong')]);
      const said = message.textContent;
      await slow;
      return [vdiPage.source === source, said, message.textContent, window.isAbandoned];

      async function decodeText() {
        const packed = Uint8Array.from(atob(document.querySelector('.vdi-frame').textContent), (c) => c.charCodeAt(0));
        return new Response(new Response(packed).body.pipeThrough(new DecompressionStream('deflate-raw'))).arrayBuffer();
      }
    })()""")
    check(sources[0] and sources[1] == sources[2] and "too few" in sources[1] and sources[3], f"the latest choice: {sources}")


def test_network(browser):
    """The page requests nothing but itself, and its policy allows nothing else."""
    asked = {event["params"]["request"]["url"] for event in browser.events
             if event.get("method") == "Network.requestWillBeSent"}
    beyond = [url for url in asked if not url.startswith(("file://", "blob:", "data:", "about:"))]
    check(not beyond, f"the page asks for {beyond}")


if sys.argv[4:] == ["speed"]:
    run(test_frame_time)
if sys.argv[4:] == ["more"]:
    run(test_pictures, test_culling_perspective, test_culling_parallel, test_small_textures, test_narrow_window, test_series,
        test_looks, test_many_contexts, test_network)
run(test_pictures, test_culling_perspective, test_hands, test_screenshot, test_clipping, test_screenshots, test_tools,
    test_damage, test_without_webgl, test_series, test_legend, test_first_look, test_framing, test_opening, test_network)
