"""Exported glTF files in three.js, drawn by headless Chromium without a graphics card. Needs selenium, Chromium and the npm package three."""
import base64
import contextlib
import http.server
import os
import shutil
import struct
import tempfile
import threading

HERE = os.path.dirname(os.path.abspath(__file__))
FLAGS = ["--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--enable-unsafe-swiftshader"]
PAGE = b"""<!doctype html><meta charset="utf-8"><script type="importmap">
{"imports": {"three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}</script>
<script type="module" src="/viewer_page.js"></script>"""


def what_is_missing(packages):
    """Why nothing can be drawn, or None."""
    if not os.path.exists(os.path.join(packages, "node_modules", "three", "build", "three.module.js")):
        return "the npm package three is not there (make test installs it where npm and a package index are)"
    if shutil.which("chromedriver") is None or shutil.which("chromium") is None:
        return "Chromium is not installed"
    try:
        import selenium.webdriver  # noqa: F401
    except ImportError:
        return "python3-selenium is not installed"
    return None


def serve(packages, folder):
    """The page, three.js under /three/ and the exported folder under /gltf/. Returns the server, which runs."""
    class Handler(http.server.SimpleHTTPRequestHandler):
        def translate_path(self, path):
            for start, where in (("/three/", os.path.join(packages, "node_modules", "three")), ("/gltf/", folder)):
                if path.startswith(start):
                    return os.path.join(where, path[len(start):])
            return os.path.join(HERE, os.path.basename(path))

        def do_GET(self):
            if self.path != "/":
                super().do_GET()
                return
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(PAGE)

        def log_message(self, *_):
            pass
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server


@contextlib.contextmanager
def page(packages, folder):
    """A driver whose page has viewer_page.js."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.support.ui import WebDriverWait
    server, profile = serve(packages, folder), tempfile.mkdtemp()
    options = webdriver.ChromeOptions()
    for flag in [*FLAGS, f"--user-data-dir={profile}"]:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)
    try:
        driver.set_script_timeout(280)
        driver.get(f"http://127.0.0.1:{server.server_port}/")
        WebDriverWait(driver, 60).until(lambda d: d.execute_script("return window.isReady === true"))
        yield driver
    finally:
        driver.quit()
        server.shutdown()
        shutil.rmtree(profile, ignore_errors=True)


def call(driver, name, *arguments):
    """What a function of the page returns; its error is raised."""
    answer = driver.execute_async_script(
        "const done = arguments[arguments.length - 1];"
        "window[arguments[0]](...Array.from(arguments).slice(1, -1)).then((value) => done({ value }), (error) => done({ error: String(error) }));",
        name, *arguments)
    if "error" in answer:
        raise RuntimeError(f"{name}: {answer['error']}; {driver.get_log('browser')}")
    return answer["value"]


def rows(packages, folder, places, px=256):
    """Mean radiances of flat cloth with the material of drape.glb. places: {lamp, camera, up, rotations} of each row."""
    with page(packages, folder) as driver:
        return call(driver, "renderRows", "/gltf/drape.glb", places, px)


def picture(packages, folder, name, view, px):
    """Rows of [r, g, b, coverage] from the top, of a file of the folder."""
    with page(packages, folder) as driver:
        data = base64.b64decode(call(driver, "renderPicture", f"/gltf/{name}", view, px))
    values = struct.unpack(f"<{4 * px * px}f", data)
    return [[values[4 * (j * px + i):4 * (j * px + i) + 4] for i in range(px)] for j in reversed(range(px))]
