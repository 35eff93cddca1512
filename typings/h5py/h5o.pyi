from typing import Any

class ObjInfo:
    fileno: int
    addr: int

def get_info(loc: Any) -> ObjInfo: ...
