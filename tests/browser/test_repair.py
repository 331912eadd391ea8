"""A job that failed by its input is repaired on its page: the field at fault is edited or its file replaced, and the job runs
again, with the real worker."""
import json

import pytest

pytest.importorskip("selenium.webdriver", reason="python3-selenium is not installed")
import selvedge  # noqa: E402
import small_cloth  # noqa: E402
from browser_page import click_on, complaints, keep, scrolls_sideways, sized, start_daemon, stop_daemon, text_of, texts, wait_for  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402

LARGE = 2 ** 53 + 3  # a seed that JavaScript would round
FIT = {"model": "two_lobe.v1", "path_budget": 50000, "render_px": 8, "render_samples": 1, "seed": LARGE,
       "fixed": {"C_R": [0.1] * 3, "beta_R": 8, "beta_TT": 12, "gamma_TT": 30}}


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    process, url = start_daemon(tmp_path_factory.mktemp("data"))
    yield selvedge.Client(url)
    stop_daemon(process)


def failed_job(client, folder, table=small_cloth.TABLE, **changes):
    """A job with a small cloth and a table, which must fail."""
    (folder / "cloth.hair").write_bytes(small_cloth.hair(groups=True))
    (folder / "rows.csv").write_text(table)
    document = {"sample": "to be repaired", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"}, "fit": FIT}
    for key, value in changes.items():
        document[key].update(value)
    job = client.submit(document, str(folder))
    with pytest.raises(selvedge.JobFailed):
        job.wait()
    return job


def open_page(browser, client, job):
    browser.get(f"{client.url}/#{job.id}")
    wait_for(browser, "document.querySelector('#repair-go')")


def write(browser, value):
    browser.execute_script("document.querySelector('#repair-value').value = arguments[0]", value)


def test_replace_the_file(client, browser, tmp_path):
    lines = small_cloth.TABLE.splitlines(keepends=True)
    job = failed_job(client, tmp_path, "".join(lines[:3] + ["fit,45,0,a lot,180,0,0.14,0.10,0.06\n"] + lines[4:]))
    open_page(browser, client, job)
    assert text_of(browser, "#repair-field") == "measurements.file" and "line 4" in text_of(browser, ".note.bad")
    assert browser.execute_script("return document.querySelector('#repair-value').value") == '"rows.csv"'
    assert [t.split()[0] for t in texts(browser, ".repair-files li")] == ["rows.csv"]
    # without a change nothing runs
    click_on(browser, "#repair-go")
    assert "Nothing has changed" in text_of(browser, "#repair-said") and job.state().state == "failed"
    keep(browser, "repair-file")
    better = tmp_path / "better.csv"
    better.write_text(small_cloth.TABLE)
    browser.find_element(By.CSS_SELECTOR, ".repair-files input").send_keys(str(better))
    assert "it will have the name rows.csv" in text_of(browser, ".repair-files li")
    click_on(browser, "#repair-go")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    assert browser.find_elements(By.CSS_SELECTOR, "#repair > *") == []
    state = job.state().raw
    assert {f["name"]: f["size"] for f in state["files"]}["rows.csv"] == len(small_cloth.TABLE) and state["document"]["fit"]["seed"] == LARGE
    assert job.result().raw["rows"][1]["measured"] == [0.14, 0.1, 0.06]
    assert complaints(browser) == []


def test_edit_the_document(client, browser, tmp_path):
    job = failed_job(client, tmp_path, fibers={"groups": ["weft", "warp", "pile"]})
    before = job.state().raw["document"]
    open_page(browser, client, job)
    assert text_of(browser, "#repair-field") == "fibers.groups"
    assert json.loads(browser.execute_script("return document.querySelector('#repair-value').value")) == ["weft", "warp", "pile"]
    keep(browser, "repair-document")
    with sized(browser, 375, 800):
        assert scrolls_sideways(browser) == []
        keep(browser, "repair-375", 375, 800)
    write(browser, '["weft", "warp"')
    click_on(browser, "#repair-go")
    assert "no JSON" in text_of(browser, "#repair-said")
    # what the server refuses is said, and the job stays as it was
    write(browser, '["weft", 7]')
    click_on(browser, "#repair-go")
    wait_for(browser, "document.querySelector('#repair-value').value === '7'")  # what is wrong in the refused text
    assert "fibers.groups[1]" in text_of(browser, "#repair-said")
    assert job.state().raw["document"] == before and job.state().state == "failed"
    write(browser, '"warp"')
    click_on(browser, "#repair-go")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    assert job.state().raw["document"] == {**before, "fibers": {"file": "cloth.hair", "groups": ["weft", "warp"]}}
    assert [c for c in complaints(browser) if "422" not in c] == []  # the refused document


def test_all_faults_are_shown(client, browser, tmp_path):
    """Of a refused document every fault has its words and its value; several are repaired at once."""
    job = failed_job(client, tmp_path, fibers={"groups": ["weft", "warp", "pile"]})
    open_page(browser, client, job)
    write(browser, '["weft", 7, "weft"]')
    click_on(browser, "#repair-go")
    wait_for(browser, "document.querySelector('#repair .note.bad')")
    wrong = {**job.state().raw["document"], "fibers": {"file": "cloth.hair", "groups": ["weft", 7, "weft"]}}
    fields = [e["field"] for e in client.request("POST", "/v1/check", json_body=wrong).json()["errors"]]
    assert all(field in text_of(browser, "#repair") for field in fields)
    write(browser, browser.execute_script("return document.querySelector('#repair-value').value").replace("7", '"warp"').replace(', "weft"]', "]"))
    keep(browser, "repair-faults")
    assert job.state().state == "failed"
    assert [c for c in complaints(browser) if "422" not in c] == []


def test_two_editors(client, browser, tmp_path):
    """Who saves second is told so, keeps the written text, and overwrites nothing."""
    job = failed_job(client, tmp_path, fibers={"groups": ["weft", "warp", "pile"]})
    open_page(browser, client, job)
    write(browser, '["mine", "warp"]')
    theirs = {**job.state().raw["document"], "fibers": {"file": "cloth.hair", "groups": ["a", "b", "c"]}}
    job.edit(theirs)
    click_on(browser, "#repair-go")
    wait_for(browser, "document.querySelector('#repair-said.bad')?.textContent.includes('changed this job meanwhile')")
    assert '"mine"' in text_of(browser, "#repair pre") and job.state().raw["document"] == theirs and job.state().state == "draft"
    assert json.loads(browser.execute_script("return document.querySelector('#repair-value').value")) == ["a", "b", "c"]
    keep(browser, "repair-two-editors")
    write(browser, '["a", "b"]')
    click_on(browser, "#repair-go")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    assert [c for c in complaints(browser) if "412" not in c] == []


def test_another_file_name_and_its_upload(client, browser, tmp_path):
    """A name in the document that has no file yet: the page asks for that file, and then the job runs."""
    job = failed_job(client, tmp_path, small_cloth.TABLE.replace("0.14", "bright"))
    open_page(browser, client, job)
    write(browser, '"new.csv"')
    click_on(browser, "#repair-go")
    wait_for(browser, "[...document.querySelectorAll('.repair-files li')].some((e) => e.textContent.startsWith('new.csv'))")
    assert job.state().state == "draft" and "new.csv is missing" in text_of(browser, "#repair-said")
    (tmp_path / "new.csv").write_text(small_cloth.TABLE)
    upload = texts(browser, ".repair-files li")
    index = next(i for i, t in enumerate(upload) if t.startswith("new.csv"))
    assert "missing" in upload[index]
    browser.find_elements(By.CSS_SELECTOR, ".repair-files input")[index].send_keys(str(tmp_path / "new.csv"))
    click_on(browser, "#repair-go")
    wait_for(browser, "document.querySelector('.state.succeeded')", 60)
    assert complaints(browser) == []


PLACE = """const done = arguments[2];
import("/repair/json_place.js").then(({ placeOf, replaced }) => {
  const place = placeOf(arguments[0], arguments[1]);
  done([place.path, arguments[0].slice(place.from, place.to), replaced(arguments[0], place, "?")]);
}).catch((error) => done(String(error)));"""


@pytest.mark.parametrize("path, inner, value", [
    ("a", "a", "17"), ("b.c[1].d", "b.c[1].d", '"x, ]}"'), ("b.c[1]", "b.c[1]", '{"d" :"x, ]}"}'), ("b.c[0]", "b.c[0]", "[[], {}]"), ("e", "e", "-1.5e3"),
    ("b.c[7].d", "b.c", None), ("b.none", "b", None), ("", "", None), ("9 \\", "9 \\", "null"), ("long", "long", str(LARGE))])
def test_places_in_a_document(client, browser, path, inner, value):
    text = '{ "a":17, "b": {"c": [[[], {}], {"d" :"x, ]}"}],\n"f":"q\\"\\\\"}, "9 \\\\": null, "long": %d , "e":-1.5e3\n}' % LARGE
    browser.get(client.url)
    found = browser.execute_async_script(PLACE, text, path)
    assert found[0] == inner and found[2] == text.replace(found[1], "?", 1)
    if value is not None:
        assert found[1] == value
    else:  # the innermost value around it
        whole = json.loads(text)
        assert json.loads(found[1]) == {"b.c[7].d": whole["b"]["c"], "b.none": whole["b"], "": whole}[path]
