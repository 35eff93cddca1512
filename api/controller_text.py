"""Controllers as a YAML file that a person reads and changes."""

from identify.recording.controller_file import ControllerFile
from identify.recording.strict_yaml import strict_yaml_text


def controller_yaml(controllers: ControllerFile) -> str:
    """The file of controllers; what is as it is when left out, is left out."""
    content = controllers.model_dump(exclude_defaults=True, mode="json")
    text = strict_yaml_text(content, width=1000)
    return (
        "# Controllers of the joints for `coulomb simulate --controller`, read from the drives: docs/simulation.md\n"
        + text.rstrip("\n")
    )
