"""A live page in Chromium, connected to a real server: frames that appear, a server that is killed and comes back,
wrong tokens, several pages, a series. Waits have no upper bound but the test's own; nothing here measures time."""
import gzip
import json
import os
import signal
import pathlib
import subprocess
import sys
import urllib.request

from pagetest import (HEIGHT, PICTURES, VDI, WIDTH, azimuth, bare, camera_of, check, compare, message_of, rendered, run, shown,
                      vdi, whole)

sys.path.append(str(pathlib.Path(__file__).parents[1] / "stream"))
from proxy import BARE, NGINX, USUAL, Nginx, example  # noqa: E402

TOKEN = "a-token-of-this-test-0123456789abcdef"
SECONDS = 60  # limit of each wait, on a busy machine


class Server:
    """vdi serve, with the token of this test."""

    def __init__(self, *words, port=0):
        with open("token", "w", encoding="utf-8") as file:
            file.write(TOKEN)
        os.chmod("token", 0o600)
        self.process = subprocess.Popen([VDI, "serve", *words, "--token-file", "token", "--port", str(port)],
                                        stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()
        self.link = f"{self.address.split('#')[0]}#token={TOKEN}"
        self.port = int(self.address.split(":")[2].split("/")[0])
        self.origin = self.address.split("#")[0].rstrip("/")

    def end(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        self.process.wait(SECONDS)
        self.process.stdout.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.end(signal.SIGKILL)


def make(path, seed, large=True):
    """A VDI of two levels, or of one."""
    kind = ["--resolution", f"{WIDTH}x{HEIGHT}", "--supersegments", 24, "--zoom", 1.6] if large else [
        "--resolution", "96x54", "--supersegments", 4]
    vdi("generate", "--field", "turbulence", "--size", "32x32x32", *kind, "--seed", seed, "-o", path)


def line(browser):
    return browser.value("document.getElementById('livetext').textContent")


def wait_for_frame(browser, frame):
    browser.wait(f"window.vdiPage && vdiPage.vdi && vdiPage.live.live.shown?.frame === {frame} && "
                 "vdiPage.live.live.shown.level + 1 === vdiPage.live.live.shown.levels", SECONDS)


def test_frames(browser):
    os.mkdir("run")
    make("run/step_0.vdi", 1)
    with Server("run") as server:
        browser.open(server.link)
        wait_for_frame(browser, 0)
        bare(browser)
        check(TOKEN not in browser.value("location.href"), "the token leaves the address")
        check(browser.value("vdiPage.live.live.shown.levels") == 2, "a frame of two levels")
        compare("live, as made", shown(browser, "live"), rendered("run/step_0.vdi", camera_of(browser)))
        turned = azimuth(camera_of(browser), 25)
        browser.value(f"vdiPage.setCamera({json.dumps(turned)})")
        make("run/step_1.vdi", 2)
        wait_for_frame(browser, 1)
        check(camera_of(browser)["position"] == turned["position"], "a new frame leaves the view unchanged")
        compare("live, turned", shown(browser, "live_turned"), rendered("run/step_1.vdi", turned))

        # A frame that arrives while the GPU's context is lost is shown once it is restored.
        browser.value("window.context = vdiPage.viewer.renderer.gl.getExtension('WEBGL_lose_context'); context.loseContext()")
        browser.wait("vdiPage.viewer.isLost", SECONDS)
        check("lost" in message_of(browser), "a lost context is reported")
        make("run/step_2.vdi", 3)
        wait_for_frame(browser, 2)
        browser.value("vdiPage.setCamera({...vdiPage.viewer.camera}, false); context.restoreContext()")
        browser.wait("!vdiPage.viewer.isLost", SECONDS)
        compare("live, after a lost context", shown(browser), rendered("run/step_2.vdi", turned))
        check(message_of(browser) == "", "the message of a lost context disappears")

        browser.send("Page.reload")
        wait_for_frame(browser, 2)
        check(line(browser).startswith(("Live", "Series", "Ended")), f"a page that is loaded again is live: {line(browser)}")
        bare(browser)
        browser.value(f"vdiPage.setCamera({json.dumps(turned)})")

        browser.value("document.getElementById('pause').click()")
        check(line(browser).startswith("Paused"), f"a pause: {line(browser)}")
        make("run/step_3.vdi", 4, large=False)
        browser.value("vdiPage.live.live.connect()")
        browser.wait("vdiPage.live.live.state === 'live' && vdiPage.live.live.isServerPaused", SECONDS)
        check(browser.value("vdiPage.frame") == 2, "a paused page keeps its frame over a reconnect")
        check(line(browser).startswith("Paused"), f"a paused page stays paused over a reconnect: {line(browser)}")
        browser.value("document.getElementById('pause').click()")
        wait_for_frame(browser, 3)

        # The server is killed, and comes back with one more frame.
        before = shown(browser)
        server.end(signal.SIGKILL)
        browser.wait("vdiPage.live.live.state === 'lost'", SECONDS)
        check("Not connected" in line(browser) and "attempt" in line(browser), f"a server that is gone: {line(browser)}")
        check((shown(browser) == before).all(), "the last frame stays")
        make("run/step_4.vdi", 5)
        with Server("run", port=server.port):
            wait_for_frame(browser, 4)
            compare("live, after a new start", shown(browser), rendered("run/step_4.vdi", turned))
        # The browser reports refused connections; the page itself throws nothing.
        complaints = [text for text in browser.complaints() if "WebSocket" not in text and "ERR_CONNECTION" not in text]
        check(not complaints, f"live: {complaints}")


def test_size(_):
    """Checks the size of the page that a server sends."""
    make("tiny.vdi", 5, large=False)
    with Server("tiny.vdi") as server:
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        with opener.open(server.link.split("#")[0], timeout=SECONDS) as reply:
            page = reply.read()
    packed = len(gzip.compress(page))
    print(f"the page: {len(page)} bytes, {packed} compressed", flush=True)
    check(len(page) <= 250000 and packed <= 60000, "the page is small")
    check(TOKEN.encode() not in page, "the page has no secret")


def test_tokens(browser):
    make("small.vdi", 5, large=False)
    with Server("small.vdi") as server:
        for link in (server.link.replace("a-token", "b-token"), server.link + "x"):
            browser.open(link)
            browser.wait("window.vdiPage && vdiPage.live.live.state === 'refused'", SECONDS)
            check("token" in message_of(browser), f"a wrong token: {message_of(browser)}")
            check(browser.value("vdiPage.vdi === undefined"), "a page with a wrong token shows nothing")
        browser.open(server.link.split("#")[0])
        check("token" in message_of(browser), f"no token: {message_of(browser)}")
        # The right link, into the same tab.
        browser.value(f"location.hash = 'token={TOKEN}'")
        wait_for_frame(browser, 0)
        check(message_of(browser) == "", "the right token after none")


def test_tls(browser):
    """A page over TLS, whose requests don't reveal the token. The browser is told to trust any
    certificate."""
    os.mkdir("secured")
    make("secured/step_0.vdi", 16, large=False)
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", "key.pem", "-out", "certificate.pem",
                    "-days", "2", "-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1"],
                   check=True, timeout=SECONDS, stderr=subprocess.DEVNULL)
    browser.send("Security.setIgnoreCertificateErrors", ignore=True)
    with Server("secured", "--certificate", "certificate.pem", "--key", "key.pem") as server:
        check(server.link.startswith("https://"), f"a link over TLS: {server.address.split('#')[0]}")
        browser.open(server.link)
        wait_for_frame(browser, 0)
        bare(browser)
        compare("over TLS", shown(browser), rendered("secured/step_0.vdi", camera_of(browser)))
        make("secured/step_1.vdi", 17, large=False)
        wait_for_frame(browser, 1)
        check(line(browser).startswith("Live"), f"a live page over TLS: {line(browser)}")
        check_requests(browser, server, "wss://")
        check(not browser.complaints(), f"over TLS: {browser.complaints()}")
    browser.send("Security.setIgnoreCertificateErrors", ignore=False)


def test_proxies(browser):
    """Behind nginx, at a path of its own: with the guide's example, and with settings that don't work."""
    if not NGINX:
        print("nginx is missing", flush=True)
        return
    make("proxied.vdi", 18, large=False)

    def state():
        return browser.value("vdiPage.live.live.state"), line(browser), message_of(browser)

    def opens(proxy):
        browser.open(f"{proxy.address}?lab=1#token={TOKEN}")

    with Server("proxied.vdi") as server:
        with Nginx(server.port, example()) as proxy:
            opens(proxy)
            wait_for_frame(browser, 0)
        with Nginx(server.port, USUAL) as proxy:
            opens(proxy)
            browser.wait("window.vdiPage && vdiPage.live.live.state === 'refused'", SECONDS)
            check(f"--origin {proxy.origin}" in message_of(browser), f"a refused origin: {state()}")
        with Nginx(server.port, BARE) as proxy:
            opens(proxy)
            browser.wait("window.vdiPage && vdiPage.live.live.cause.includes('WebSockets')", SECONDS)
            check(state()[0] in ("lost", "connecting"), f"a proxy without WebSockets: {state()}")
            server.end()
            browser.wait("vdiPage.live.live.cause.includes('HTTP status 502')", SECONDS)
        browser.wait("vdiPage.live.live.cause === \"the server doesn't answer\"", SECONDS)


def check_requests(browser, server, scheme):
    """Checks that a page asks only its server, when it is opened and loaded again, and that no request has the token."""
    browser.send("Page.reload")
    browser.wait("window.vdiPage?.vdi && vdiPage.live.live.state === 'live'", SECONDS)
    urls, headers = set(), []
    for event in browser.events:
        method, more = event.get("method"), event.get("params", {})
        if method == "Network.requestWillBeSent":
            urls.add(more["request"]["url"])  # without the fragment, which a browser doesn't send
            headers.append(more["request"]["headers"])
        elif method == "Network.webSocketCreated":
            urls.add(more["url"])
        elif method == "Network.webSocketWillSendHandshakeRequest":
            headers.append(more["request"]["headers"])
        elif method == "Network.requestWillBeSentExtraInfo":
            headers.append(more["headers"])
    urls = {url for url in urls if not url.startswith(("blob:", "data:", "about:"))}
    expected = {server.origin + "/", scheme + server.origin.split("://")[1] + "/stream"}
    check(urls == expected, f"the page asks only its server: {urls}")
    names = {name.lower() for one in headers for name in one}
    check("sec-websocket-key" in names and len(headers) >= 3, f"requests with their headers: {len(headers)}, {names}")
    check(TOKEN not in json.dumps([sorted(urls), headers]), "no request has the token in its URL or in a header")
    check("referer" not in names, "no request says where it comes from")


def test_pages(browser):
    """Several pages at once get the same frames, and a page that closes meanwhile doesn't disturb
    the others."""
    os.mkdir("shared")
    make("shared/step_0.vdi", 6, large=False)
    first = browser.session
    with Server("shared") as server:
        sessions = [first] + [browser.add_page() for _ in range(2)]
        for session in sessions:
            browser.session = session
            browser.size(WIDTH, HEIGHT)
            browser.open(server.link)
        for session in sessions:
            browser.session = session
            wait_for_frame(browser, 0)
        browser.send("Page.navigate", url="about:blank")
        make("shared/step_1.vdi", 7, large=False)
        for session in sessions[:2]:
            browser.session = session
            wait_for_frame(browser, 1)
            bare(browser)
            compare("one of several pages", shown(browser), rendered("shared/step_1.vdi", camera_of(browser)))
        browser.session = first


def test_series(browser):
    for i in range(3):
        make(f"part_{i}.vdi", 8 + i, large=False)
    with Server("part_0.vdi", "part_1.vdi", "part_2.vdi") as server:
        browser.open(server.link)
        browser.wait("window.vdiPage && vdiPage.vdi && !document.getElementById('series').hidden", SECONDS)
        bare(browser)
        browser.value("(() => { const s = document.getElementById('frame'); s.value = 1;"
                      " s.dispatchEvent(new Event('input')); })()")
        wait_for_frame(browser, 1)
        compare("frame 1 of a series", shown(browser), rendered("part_1.vdi", camera_of(browser)))
        browser.value("document.getElementById('view').focus()")
        browser.key(" ")
        for i in (0, 1, 2):
            browser.wait(f"vdiPage.frame === {i}", SECONDS)
        browser.key(" ")
        check(not browser.value("vdiPage.isPlaying"), "the space bar stops a series")
        whole(browser)


def test_missing_frame(browser):
    """A series plays on without a frame whose file is deleted before any page requests it."""
    for i in range(3):
        make(f"gap_{i}.vdi", 20 + i, large=False)
    with Server("gap_0.vdi", "gap_1.vdi", "gap_2.vdi") as server:
        browser.open(server.link)
        wait_for_frame(browser, 2)
        os.remove("gap_1.vdi")
        browser.value("""(() => {
          window.lines = [];
          const text = document.getElementById('livetext');
          new MutationObserver(() => lines.push(text.textContent)).observe(text, {childList: true});
        })()""")
        browser.value("document.getElementById('view').focus()")
        browser.key(" ")
        for i in (0, 2, 0):
            browser.wait(f"vdiPage.frame === {i}", SECONDS)
        check(browser.value("vdiPage.isPlaying"), "a missing frame doesn't stop a series")
        lines = browser.value("lines")
        check(any("frame 2: the file is damaged or gone" in text for text in lines), f"the line reports it: {lines}")
        browser.key(" ")
        whole(browser)


# A connection whose steering messages come from this test, because vdi serve has nothing to steer.
STEERED = """
class Steered extends WebSocket {
  constructor(...words) { super(...words); window.wire = this; this.asked = []; }
  send(text) {
    const message = JSON.parse(text);
    if (["drive", "release", "steer"].includes(message.type)) this.asked.push(message);
    else super.send(text);
  }
  say(message) {
    this.onmessage({data: JSON.stringify({
      type: "steering", you: 2, driver: null, period: 1, paused: false,
      parameters: [{name: "feed", whole: false, value: 0.03, low: 0, high: 0.1}],
      generator: {resolution: [640, 360], supersegments: 25, range: [0, 0.5], presets: ["X Ray"]}, ...message})});
  }
}
window.WebSocket = Steered;
"""


def check_phone(browser):
    """With the panel open on a phone, the picture is above it."""
    browser.size(360, 640)
    whole(browser)
    browser.screenshot(os.path.join(PICTURES, "steer_phone.png"))
    places = browser.value("""['#view', '#steer > div', '#bar']
      .map((name) => document.querySelector(name).getBoundingClientRect()).map(({top, bottom}) => [top, bottom])""")
    check(places[0][1] <= places[1][0] + 1 and places[0][1] > 250 and places[1][1] <= places[2][0],
          f"picture, panel and bar don't overlap: {places}")
    browser.size(WIDTH, HEIGHT)
    whole(browser)


def test_steering(browser):
    os.mkdir("steered")
    make("steered/step_0.vdi", 12, large=False)
    script = browser.send("Page.addScriptToEvaluateOnNewDocument", source=STEERED)["identifier"]

    def asked():
        return browser.value("wire.asked.splice(0)")

    def enter(name, value):
        browser.value(f"(() => {{ const field = document.querySelector({json.dumps(name)}); field.value = {json.dumps(value)};"
                      " field.dispatchEvent(new Event('input')); field.dispatchEvent(new Event('change')); })()")

    def hidden(name):
        return browser.value(f"document.getElementById('{name}').offsetParent === null")

    with Server("steered") as server:
        browser.open(server.link)
        wait_for_frame(browser, 0)
        check(hidden("steer") and hidden("newview"), "a server that allows no steering shows nothing of it")
        browser.value("wire.say({})")
        browser.value("document.getElementById('steer').open = true")
        check(hidden("newview") and not hidden("drive") and browser.value("document.getElementById('period').disabled"),
              "a viewer who doesn't drive sees what is in force, and changes nothing")
        browser.value("document.getElementById('drive').click()")
        check(asked() == [{"type": "drive"}], "a wish to drive")
        browser.value("wire.say({driver: 2})")
        check(not hidden("newview"), "a driver may ask for a new view")
        enter("#parameters input", 0.05)
        enter("#parameters input[type=number]", 7)
        enter("#period", 3)
        enter("#supersegments", 1025)
        enter("#supersegments", 1024)
        enter("#resolution", "960 × 540")
        enter("#preset", "X Ray")
        enter("#high", 0.25)
        browser.value("document.getElementById('halt').click()")
        wishes = asked()
        check([{key: wish[key] for key in wish if key != "type"} for wish in wishes] == [
            {"parameters": {"feed": 0.05}}, {"parameters": {"feed": 0.1}}, {"period": 3}, {"supersegments": 1024},
            {"resolution": [960, 540]}, {"preset": "X Ray"}, {"range": [0, 0.25]}, {"paused": True}], f"wishes: {wishes}")
        # What the simulation hasn't taken yet is shown, until it is in force or refused.
        requested = "document.getElementById('requested').textContent"
        words = browser.value(requested)
        check(all(word in words for word in ("feed", "period", "resolution", "pause", "requested")), f"pending: {words}")
        check(words in line(browser), f"the line has what is pending: {line(browser)}")
        check(browser.value("document.getElementById('halt').textContent") == "Pausing…", "a pause is pending")
        browser.wait(f"{requested}.includes('s ago')", SECONDS)
        browser.value("""wire.say({driver: 2, paused: true, period: 3, parameters: [{name: "feed", whole: false, value: 0.1,
          low: 0, high: 0.1}], generator: {resolution: [960, 540], supersegments: 1024, range: [0, 0.2500000001],
          presets: ["X Ray"], preset: "X Ray"}})""")
        check(browser.value(requested) == "", f"all is in force: {browser.value(requested)}")
        check(browser.value("document.getElementById('preset').value") == "X Ray", "the colour map in force")
        browser.value("document.getElementById('halt').click()")
        check("go on requested" in browser.value(requested), f"pending: {browser.value(requested)}")
        browser.value("wire.onmessage({data: JSON.stringify({type: 'denied', cause: 'no'})});"
                      " wire.say({driver: 2, paused: true})")
        check(browser.value(requested) == "" and asked() == [{"type": "steer", "paused": False}],
              "a refused request isn't pending")
        # A link has the token only on demand.
        link = "document.getElementById('sharelink').value"
        browser.value("document.getElementById('link').click()")
        check("token" not in browser.value(link), f"a link without the token: {browser.value(link)}")
        browser.value("document.getElementById('sharetoken').click()")
        check(f"#token={TOKEN}&camera=" in browser.value(link), "a link with the token")
        browser.value("document.getElementById('share').close()")
        browser.wait(f"{link} === ''", SECONDS)
        near, far = azimuth(camera_of(browser), 10), azimuth(camera_of(browser), 40)

        def rest_at(camera):
            browser.value(f"vdiPage.setCamera({json.dumps(camera)})")
            whole(browser)
            browser.value("new Promise((done) => setTimeout(done, 400))")
            return asked()

        check(rest_at(near) == [], "nothing is requested unless Auto is on")
        browser.value("document.getElementById('newview').click()")
        check("new view requested" in browser.value(requested), f"pending: {browser.value(requested)}")
        check_phone(browser)
        wish = asked()[0]
        check(wish["camera"]["position"] == near["position"] and wish["camera"]["viewAngle"] == near["viewAngle"], f"{wish}")
        browser.value("document.getElementById('auto').click()")
        check(rest_at(near) == [], "Auto leaves small angles alone")
        wishes = rest_at(far)
        check([wish["camera"]["position"] for wish in wishes] == [far["position"]], f"Auto asks once: {wishes}")
        check(rest_at(far) == [], "Auto doesn't ask again for the same view")
        browser.value("wire.say({driver: 5})")
        check("Viewer 5" in browser.value("document.getElementById('driver').textContent") and hidden("newview"),
              "another viewer drives")
        check(rest_at(azimuth(far, 30)) == [], "a viewer who doesn't drive asks for nothing")
    browser.send("Page.removeScriptToEvaluateOnNewDocument", identifier=script)


run(test_frames, test_size, test_tokens, test_tls, test_proxies, test_pages, test_series, test_missing_frame, test_steering)
