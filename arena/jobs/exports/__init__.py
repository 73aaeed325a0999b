"""Tables and files of a job."""
