"""Work for a Ray cluster: ``python -m relief.ray render JOB`` and ``python -m relief.ray rollouts ENVIRONMENT``.

`cluster` hands out tasks and does again what fails. `shards` renders the parts of a run that ``relief split`` made, and
`rollouts` lets a policy drive episodes. See docs/many_machines.md.

This needs Ray on all machines: ``pip install '.[ray]'``.
"""
