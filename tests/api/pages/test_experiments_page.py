"""The first visit shows the ways to a first experiment; later ones list the experiments."""

from api.service.accounts import Role

HTML = {"Accept": "text/html"}


def test_the_first_visit_shows_three_ways_to_who_may_change_something(service):
    operator, viewer = service.client(Role.OPERATOR), service.client(Role.VIEWER, "vera")
    assert operator.get("/", headers=HTML, follow_redirects=False).headers["location"] == "/pages/experiments"
    text = operator.get("/pages/experiments", headers=HTML).text
    for way in ("Try it on the simulated arm", "Upload a record", "Connect a rig"):
        assert f"<h3>{way}</h3>" in text
    assert 'hx-post="/pages/demo"' in text  # one click to a result, or the same step by step
    assert 'href="/pages/new-session?rig=rx130l-joint3-simulated"' in text
    assert operator.get("/pages/new-session?rig=rx130l-joint3-simulated", headers=HTML).status_code == 200
    seen = viewer.get("/pages/experiments", headers=HTML).text
    for way in ("Try it on the simulated arm", "Upload a record", "Connect a rig"):
        assert f"<h3>{way}</h3>" in seen
    assert "hx-post" not in seen.partition('class="ways"')[2].partition("</section>")[0]
    assert seen.count("you are signed in as a viewer") == 2
