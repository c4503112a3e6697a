SELECT kind, name FROM removal ORDER BY kind, name
