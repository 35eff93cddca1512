from drivers.scan import scan


def test_all_nodes_of_a_bus_are_found_with_identity_and_state(open_bench, axis):
    bench = open_bench(axis(node=2), axis(node=17), axis(node=127))
    bench.drives[1].produce_heartbeat(0.02)
    bench.node.drive.fail(0x4310)
    found = scan(bench.bus, wait=0.1)
    assert [node.node for node in found] == [2, 17, 127]
    assert {(node.profile, node.vendor, node.product, node.revision) for node in found} == {
        (402, 0, 0x402, 0x10000)
    }
    assert [node.state for node in found] == ["FAULT", "SWITCH ON DISABLED", "SWITCH ON DISABLED"]
    assert [node.nmt_state for node in found] == [None, "PRE-OPERATIONAL", None]


def test_a_node_that_is_only_heard_is_listed_too(open_bench, axis):
    bench = open_bench(axis(node=2))
    bench.drive.produce_heartbeat(0.02)
    take_sdo = bench.node.take_sdo
    bench.node.take_sdo = lambda data: None
    (node,) = scan(bench.bus, wait=0.3)
    bench.node.take_sdo = take_sdo
    assert (node.node, node.device_type, node.profile, node.state) == (2, None, None, None)
    assert node.nmt_state == "PRE-OPERATIONAL"


def test_an_empty_bus_has_no_nodes_and_scanning_writes_nothing(open_bench):
    bench = open_bench()
    bench.receiver.read()
    assert scan(bench.bus, wait=0.05, nodes=range(50, 60)) == []
    sent = bench.receiver.read()
    assert {int(can_id) for can_id in sent["can_id"]} == set(range(0x600 + 50, 0x600 + 60))
    assert set(sent["data"][:, 0]) == {0x40}  # uploads only


def test_unless_told_otherwise_every_node_that_may_be_is_asked_and_no_other(open_bench):
    """CiA 301: node ids are 1 to 127; 0x600 and 0x680 are nobody's."""
    bench = open_bench()
    bench.receiver.read()
    assert [node.node for node in scan(bench.bus, wait=0.05)] == [axis.node for axis in bench.settings.axes]
    sent = {int(can_id) for can_id in bench.receiver.read()["can_id"]}
    assert {can_id for can_id in sent if 0x600 <= can_id <= 0x680} == set(range(0x601, 0x680))
