"""The error that a user's input can cause."""


class InputError(Exception):
    """What the user gave is wrong: one line that names the file, line or field and says what would be right.

    The command line turns it into exit status 2, the REST service into a problem document of status 422.
    """
