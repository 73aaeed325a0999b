"""Jobs: what contestants made of scenarios, how it was judged, driven and labelled."""
