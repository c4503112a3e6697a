-- The line of queued jobs that may begin at ?1 (ms), for statements that include it: the first of each project, then the second of
-- each; of those the one whose project has not begun a job for longest. Number 1 is next.
WITH place AS (SELECT seq, project, row_number() OVER (PARTITION BY project ORDER BY priority DESC, seq) AS of_project
                 FROM job WHERE state = 'queued' AND not_before_ms <= ?1),
     line AS (SELECT seq, row_number() OVER (ORDER BY of_project,
                (SELECT max(started_ms) FROM job AS begun WHERE begun.project = place.project), seq) AS number FROM place)
