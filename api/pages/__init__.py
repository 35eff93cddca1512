"""The web pages that an operator works in: server-rendered, htmx for actions, figures as SVG made on the server."""
