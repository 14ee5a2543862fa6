# docker build -t growthx .
# docker run --rm --init growthx pytest
# docker run --rm --init --user "$(id -u):$(id -g)" -v "$PWD:$PWD" -w "$PWD" growthx growthx femur --out results
# (--init: Ctrl-C stops it, and xvfb-run does not wait for ever)
FROM debian:trixie-slim
COPY packages.txt /growthx/
RUN apt-get update \
    && sed 's/#.*//' /growthx/packages.txt \
       | DEBIAN_FRONTEND=noninteractive xargs apt-get install --yes --no-install-recommends \
    && rm -rf /var/lib/apt/lists/*
# A home that any --user may write: compiled forms are kept there.
RUN mkdir --mode=1777 /home/growthx
COPY . /growthx
WORKDIR /growthx
ENV HOME=/home/growthx LC_ALL=C.UTF-8 GROWTHX_ENVIRONMENT=python \
    PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
# ./run knows "growthx" and how OpenMPI is to behave; more ranks than cores are allowed above.
ENTRYPOINT ["/growthx/run"]
CMD ["growthx", "--help"]
