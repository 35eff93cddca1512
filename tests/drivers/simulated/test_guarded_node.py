"""The slave's side of node guarding, by CiA 301, 7.2.8.3.2.1."""

from drivers.simulated.guarded_node import GuardedNode


def asked(times, **settings):
    """A node asked at these instants (s), and the bytes that it answered."""
    answers = []
    node = GuardedNode(0x705, lambda: 5, lambda can_id, data: answers.append((can_id, *data)))
    for name, value in settings.items():
        setattr(node, name, value)
    for now in times:
        node.answer(now)
    return node, answers


def test_answers_hold_the_state_and_a_bit_that_changes():
    _, answers = asked([0.0, 0.1, 0.2])
    assert answers == [(0x705, 0x05), (0x705, 0x85), (0x705, 0x05)]


def test_after_a_boot_up_the_toggle_bit_is_0():
    node, answers = asked([0.0])
    node.restart()
    node.answer(1.0)
    assert answers == [(0x705, 0x05), (0x705, 0x05)]


def test_the_master_is_missed_after_the_life_time_once_it_has_asked():
    life_time = {"guard_time": 0.1, "life_time_factor": 3}
    assert not asked([], **life_time)[0].master_lost(99.0)
    node, _ = asked([1.0], **life_time)
    assert (node.master_lost(1.29), node.master_lost(1.31)) == (False, True)
    assert not asked([1.0], guard_time=0.1)[0].master_lost(99.0)
