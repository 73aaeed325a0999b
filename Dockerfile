# One image for the web server and the workers; compose.yaml puts them together.
FROM python:3.12-slim
ENV PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1
RUN useradd --uid 1000 --create-home arena
WORKDIR /home/arena/app
COPY requirements.txt .
RUN pip install --no-cache-dir --require-hashes -r requirements.txt
# By name, so that no .env and no data of this folder gets into the image.
COPY manage.py pyproject.toml ./
COPY arena arena
COPY augment augment
COPY fixtures fixtures
COPY static static
COPY templates templates
RUN mkdir -p /data/var /data/media && chown -R arena /data
USER arena
ENV ARENA_VAR_DIR=/data/var ARENA_MEDIA_DIR=/data/media
EXPOSE 8000
CMD ["sh", "-c", "python manage.py prepare && exec gunicorn arena.config.wsgi --worker-class arena.serving.web_worker.BufferingWorker --bind 0.0.0.0:8000 --workers 2 --threads 4"]
