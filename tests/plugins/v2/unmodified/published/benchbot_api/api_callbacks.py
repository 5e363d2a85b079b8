def convert_to_rgb(data):
    return data["data"][..., ::-1] if data["encoding"] == "bgr8" else data["data"]
