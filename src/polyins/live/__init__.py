"""The engine on live data: sources of samples, the session that navigates on them, sinks for what comes out."""
