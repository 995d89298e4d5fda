"""How accurate identification is: tables against the truth of simulated recordings, against other libraries, and against the bound.

A *case* is a kind of recording, a *method* turns a recording into errors in %, and a *measurement* runs methods on many recordings of
some cases. Results are kept in a file, so that a run that was cut off goes on where it stopped; every measurement writes its section of
a Markdown report.
"""
