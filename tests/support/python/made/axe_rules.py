"""axe-core in a page of the dashboard: what a person with a screen reader, a keyboard or weak sight would miss.

It is installed from PyPI into a virtual environment in the build folder; without a network the tests are skipped."""
import glob
import os
import subprocess

import pytest
from browser_page import BUILD

RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"]


def axe_source():
    """Returns the JavaScript of axe-core, or skips the test with the reason."""
    venv = os.path.join(BUILD, "axe")
    found = os.path.join(venv, "lib", "python3*", "site-packages", "axe_playwright_python", "axe.min.js")
    if not glob.glob(found):
        pip = [os.path.join(venv, "bin", "pip"), "install", "-q", "--no-deps", "axe-playwright-python==0.1.8"]
        for command in (["/usr/bin/python3", "-m", "venv", venv], pip):
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode != 0:
                pytest.skip(f"axe-core cannot be installed: {(done.stderr or done.stdout).strip()[-200:]}")
    with open(glob.glob(found)[0], encoding="utf-8") as f:
        return f.read()


def serious_findings(browser, source):
    """Returns one line for each element that breaks a rule of WCAG 2.1 AA with serious or critical impact."""
    browser.execute_script(source)
    found = browser.execute_async_script("""
        const done = arguments[arguments.length - 1];
        axe.run(document, {runOnly: arguments[0], resultTypes: ["violations"]}).then((r) => done(r.violations), (e) => done(String(e)));""", RULES)
    assert isinstance(found, list), found
    return [f"{v['id']}: {n['target'][0]}: {n['failureSummary'].splitlines()[-1].strip()}"
            for v in found if v["impact"] in ("serious", "critical") for n in v["nodes"]]
