"""Pictures of results. Nothing here trains; each function reads finished stores."""
