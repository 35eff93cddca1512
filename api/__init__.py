"""The command line, the REST service and the web pages."""
