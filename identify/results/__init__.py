"""What the identifier, the diagnosis and the planner of experiments found, as typed, versioned documents.

One file for each kind of document. The contract's JSON is their dump; command line, REST service, client, pages, reports
and stored model stories read these types and nothing else of a result. Everything is in SI units and joint space: rad
or m, N m or N, s, kg.
"""
